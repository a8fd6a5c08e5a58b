// What a page shows of a run at given times: of both kinds of systems alike, with the ground's forces worked out.
#pragma once
#include "march/log.hpp"
#include "march/start.hpp"
#include "packet/packet.hpp"

namespace tarsus {

// A sampled moment: time [s]; coordinates x, v (n,) of the structure; of every foot its gap [m] and gap rate [m/s], what it does, its
// place [m], speed [m/s] and sense along the ground; of feet in a structure also its force on a held one [N].
struct PageFrame {
  double time = 0.0;
  std::vector<double> x, v, gap, rate, state, along, speed, sense, pull, friction;

  PageFrame(size_t n, size_t feet) : x(n), v(n), gap(feet), rate(feet), state(feet), along(feet), speed(feet), sense(feet), pull(feet), friction(feet) {}
};

// How long each foot has been held [s], by the events of a run; as `tarsus.solve.series.strength_of` has it.
class Ages {
 public:
  Ages(const std::vector<Event>& events, const ActingLaws& laws, size_t feet) : events_(events), laws_(laws), begun_(feet, 0.0), ended_(feet, 0.0), brought_(feet, 0.0), met_(feet, false) {}

  // Move on to a time; times only grow.
  void seek(double time) {
    for (; next_ < events_.size() && events_[next_].time <= time; next_++) {
      const Event& event = events_[next_];
      const size_t i = size_t(event.foot);
      const int kind = int(event.kind);
      if (kind == RELEASE) ended_[i] = event.time;
      if (kind != CAPTURE && kind != REST && kind != CONTACT_AT_START && kind != AVERAGED_CONTACT) continue;
      brought_[i] = met_[i] ? laws_.remaining(int(i), ended_[i] - begun_[i] + brought_[i], event.time - ended_[i]) : 0.0;
      begun_[i] = event.time;
      met_[i] = true;
    }
  }
  double of(size_t foot, double time) const { return std::max(time - begun_[foot], 0.0) + brought_[foot]; }

 private:
  const std::vector<Event>& events_;
  const ActingLaws& laws_;
  std::vector<double> begun_, ended_, brought_;
  std::vector<bool> met_;
  size_t next_ = 0;
};

// Rows of a run: time [s]; volts of the drives; of every foot its gap [m], the force of the ground on it upward and along the ground [N],
// what it does (Contact) and its place along the ground [m]; coordinates of the structure that are the body's; kinetic and elastic
// energy [J]. mass, damping (n, n): of the structure; stiffness, loads: see StartRules; body: how many coordinates are shown.
class PageSamples {
 public:
  explicit PageSamples(const Packet& packet)
      : packet_(packet), mass_(packet.doubles("seen.mass")), damping_(packet.doubles("seen.damping")), shown_(packet.size("rows.shown")),
        body_(size_t(packet.whole("seen.body"))) {}

  size_t width(size_t feet) const { return 1 + shown_ + 5 * feet + body_ + 2; }

  void check(const StartRules& rules, const Signals& signals) const {
    Fields::check("seen", mass_.size() == rules.n * rules.n && damping_.size() == mass_.size() && body_ <= rules.n);
    const int64_t* channels = packet_.at<int64_t>("rows.shown", shown_);
    for (size_t d = 0; d < shown_; d++) Fields::check("rows.shown", channels[d] >= 0 && channels[d] < signals.channels());
  }

  // The force of the structure on a coordinate that is held [N]: loads and weight less springs and dampers.
  double onto(const StartRules& rules, const Starting& run, const std::vector<double>& drives, const PageFrame& at, size_t r) const {
    double sum = 0.0;
    for (size_t g = 0; g < GRAVITIES; g++) sum += rules.weight[GRAVITIES * r + g] * run.sources[rules.m + g];
    for (size_t d = 0; d < rules.drives; d++) sum += rules.loads[r * rules.drives + d] * drives[d];
    for (size_t c = 0; c < rules.n; c++) sum -= rules.stiffness[r * rules.n + c] * at.x[c] + damping_[r * rules.n + c] * at.v[c];
    return sum;
  }

  void add(const StartRules& rules, const PageFrame& at, const ActingLaws& laws, const Ages& ages,
           const Player& volts, const Player& driven, std::vector<double>& out) const {
    const size_t m = rules.m;
    out.push_back(at.time);
    for (size_t d = 0; d < shown_; d++) out.push_back(volts.value(int(d), at.time));
    std::vector<double> ground(m), along(m);
    for (size_t i = 0; i < m; i++) {
      if (at.state[i] == AIR) continue;
      const int64_t channel = laws.laws.volts[i];
      const double charged = channel >= 0 ? driven.value(int(channel), at.time) : 0.0;
      ground[i] = -(at.pull[i] + laws.force(int(i), at.gap[i], at.rate[i], charged, at.time));
      along[i] = at.friction[i];
      if (at.state[i] != SLIPPING) continue;
      const double held = laws.strength(int(i), ages.of(i, at.time), charged);
      along[i] = -at.sense[i] * laws.friction(int(i), std::max(held + ground[i], 0.0), held, at.speed[i]);
    }
    for (const std::vector<double>* part : {&at.gap, &std::as_const(ground), &std::as_const(along), &at.state, &at.along}) out.insert(out.end(), part->begin(), part->end());
    out.insert(out.end(), at.x.begin(), at.x.begin() + long(body_));
    out.push_back(energy(mass_, at.v));
    out.push_back(energy(rules.stiffness, at.x));
  }

 private:
  const Packet& packet_;
  std::vector<double> mass_, damping_;
  size_t shown_, body_;

  static double energy(const std::vector<double>& matrix, const std::vector<double>& z) {
    double sum = 0.0;
    for (size_t r = 0; r < z.size(); r++) {
      for (size_t c = 0; c < z.size(); c++) sum += 0.5 * z[r] * matrix[r * z.size() + c] * z[c];
    }
    return sum;
  }
};

}  // namespace tarsus
