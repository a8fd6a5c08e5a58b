// Derivatives of a legged robot's run: lanes that follow it through its steps and events (see docs/gradients.md).
//
// At an event the state is taken along with its moment, which moves by dt = -dg / g': Dz = dz + z' dt before it, what the event
// does, and dz = Dz - z' dt after it. Feet know of each other only through the body, so that each event has a moment of its own.
#pragma once
#include "derive/legged_told.hpp"

namespace tarsus::legged {

class LeggedTangent : public LeggedTold {
 public:
  using LeggedTold::LeggedTold;

  Code step() {
    step_class = std::max(step_class, resolving());
    return followed_step(*this);
  }

  // Every step, before the run's state moves on.
  void made(int k, double h, double fraction, double reached) {
    pass_kinks(h);
    for (Legged& t : lanes_) t.step_class = k;
    h_ = h;
    fraction_ = fraction;
    open_ = false;
    begin_time_ = clock.time;
    rebase_lanes();
    linearise(h);
    for (int i : body.leg) {
      if (nearly_lands(i, h, fraction)) flag(NEAR_MISS, -1);
    }
    follow_beside(k, h);
    if (!solve_lanes(*this, lanes_, k, h, linear_)) lose();
    for (size_t n = notes.sampled; fraction > 0.0 && n < notes.times.size() && notes.times[n] <= reached; n++) {
      sample(h, std::max(std::min((notes.times[n] - clock.time) / h, fraction), 0.0), notes.times[n]);
    }
    apexes_.clear();
    for (int i : body.leg) apexes_.push_back(feet[i].apex.gap);
    ways_.clear();
    for (const LeggedFoot& foot : feet) ways_.push_back(foot.u[ALONG]);
    if (keeps_account && fraction > 0.0) add_power(*this, lanes_, beside_, data_, h, fraction);
  }

  // And after.
  void moved(double h, double fraction) {
    if (fraction <= 0.0) return;
    for (size_t lane = 0; lane < lanes_.size(); lane++) move_lane_on(int(lane), h, fraction);
  }

  // An event, before and after the run's state is changed by it.
  void happens(int i, Happening kind) {
    known_ = log.events.size();
    place_ = place();
    before_ = still_.on(place_).rates();
    const Jet value = acting_.on(place_).function(i, kind);
    const double rate = rate_of(i, kind);
    if (!open_) note_rates();
    at_once_ = fraction_ == 0.0 && shared_at_ == clock.time && shares_moment(i, kind, value.value);
    if (!at_once_) {
      const Row own = -slope_of(value) / rate;
      if (open_) flag_order(own, rate, former_[body.legs[i].foot]);
      shared_ = own;
      if (grazes(i, kind, rate)) flag(GRAZING, -1);
    }
    open_ = true;
    shared_at_ = clock.time;
    shift(place_, before_, shared_);
  }

  void happened(int i, Happening kind) {
    const bool told = log.events.size() > known_;
    const int what = told ? int(log.events.back().kind) : 0;
    Struck out;
    out.when = place_.time;
    acting_.on(place_);
    Jet& along = acting_.w(i, ALONG);
    if (kind == TOUCH) {
      out = acting_.land(i, what);
      if (what == 0 || (what == CONTACT_AT_START && !at_once_)) flag(GRAZING, -1, known_);
      if (feet[i].contact == STUCK) stop_along(along);
    } else if (kind == PULL_OFF) {
      out.pull = pull_on(acting_, i);
      out.strength = acting_.strength(i);
      acting_.w(i, UP) = leaving_rate(acting_, i, Jet(0.0));
    } else {
      out.pull = acting_.along(i);
      out.strength = acting_.bound(i, Jet(0.0));
      out.doubtful = kind == STOP && is_close(Jet(std::fabs(out.pull.value)), out.strength);
      along = Jet(0.0);
    }
    if (out.doubtful) flag(AT_THRESHOLD, -1, known_);
    if (told) note_event(i, what, out);
    settle();
  }

  void mark() {
    const double turns = std::isfinite(settings.period) ? std::round(clock.time / settings.period) : 0.0;
    const bool whole = std::fabs(clock.time - turns * settings.period) <= 1e-12 * clock.time && clock.time < settings.end;
    const Row by = whole ? data_.period * turns : Row(0.0);
    const bool moves = any_less(Row(0.0), magnitude(by));
    JetPlace here = place();
    const Rates now = moves ? still_.on(here).rates() : Rates{};
    const size_t seen = log.events.size();
    const bool low = x[1] <= lowest_body, high = x[1] >= highest_body;
    std::vector<Apex> apexes;
    for (int i : body.leg) apexes.push_back(feet[i].apex);
    LeggedMarch::mark();
    mark_lanes(by, moves ? &now : nullptr, low, high);
    for (size_t e = seen; e < log.events.size(); e++) {
      const int f = int(log.events[e].foot);
      const bool rising = apexes[f].time == clock.time && apexes[f].gap > 0.0;
      note_mark(body.leg[f], by, moves ? &now : nullptr, rising);
    }
  }

 private:
  size_t known_ = 0;
  bool open_ = false, at_once_ = false;  // an event has happened in this step; the present one shares its moment
  std::vector<double> former_;           // rates of the functions of its events before the first of them, by foot

  // First step class in which the nodes resolve how the body moves on its held legs: a run that is at rest needs no such
  // steps, its derivatives do.
  int resolving() const {
    double rate = 0.0;
    for (int b = 0; b < coordinates(); b++) {
      rate = std::max({rate, std::sqrt(together.stiffness[b][b] / body.mass[b]), together.damping[b][b] / body.mass[b]});
    }
    int k = 0;
    while (k + 1 < tables.classes() && tables.lengths[k] * rate > RESOLVED) k++;
    return k;
  }
  static constexpr double RESOLVED = 0.75;  // radians in a step: polynomials of degree 7 leave 1e-10 of a sine

  // Rate [1/s] of an event's function as the state moves on.
  double rate_of(int i, Happening kind) {
    JetPlace on = place_;
    const auto still = [](std::vector<Jet>& values) {
      for (Jet& one : values) one = Jet(one.value);
    };
    for (auto* part : {&on.x, &on.v, &on.u, &on.w, &on.since}) still(*part);
    shift(on, before_, Row(1.0));
    return still_.on(on).function(i, kind).slope[0];
  }

  // Whether an event at the start of a step comes with what happened just before it: a jump beyond rounding, or a foot that
  // lies there from the start.
  bool shares_moment(int i, Happening kind, double value) const {
    if (kind == TOUCH) return clock.time == begun_ || -place_.of(place_.w, i, UP).value <= no_rate(*this, i, 0.0);
    if (kind == STOP) return clock.time == begun_;
    return clock.time == begun_ || value < -JUMP * run_.scales[1];
  }
  static constexpr double JUMP = 1e-9;  // part of the scale of forces; functions that pass zero overshoot it by less

  // Whether a flight turns in the step so close above the ground that an error of its gap could hide a touchdown; as ``touches``.
  bool nearly_lands(int i, double h, double fraction) const {
    const LegRows& r = rows[i];
    const double room = GRAZE * settings.gap;
    if (feet[i].contact != AIR || r.gap[0] <= room) return false;
    for (int j = 1; j < N && nodes.tau[j - 1] < fraction; j++) {
      if (!(r.rate[j - 1] < 0.0 && 0.0 < r.rate[j])) continue;
      const double width = (nodes.tau[j] - nodes.tau[j - 1]) * h;
      const double drop = 0.5 * width * r.rate[j - 1] * r.rate[j - 1] / (r.rate[j] - r.rate[j - 1]);
      if (std::min(r.gap[j - 1], r.gap[j]) >= 2.0 * drop + room) continue;
      const Lowest least = lowest_between(*this, j, [&](double at) { return gap_at(*this, i, h, at); });
      if (least.at < fraction && least.gap < room) return true;
    }
    return false;
  }

  // A touchdown that would dip below the ground by less than GRAZE errors of a gap; a force or speed that hardly passes zero.
  bool grazes(int i, Happening kind, double rate) const {
    if (kind == TOUCH) {
      const double bend = before_.w[DIRECTIONS * size_t(i) + UP];
      return bend > 0.0 && 0.5 * rate * rate < GRAZE * settings.gap * bend;
    }
    const double size = kind == STOP ? settings.gap / (settings.end * settings.end) : 1e-9 * run_.scales[1] / settings.end;
    return !(std::fabs(rate) > size);
  }
  static constexpr double GRAZE = 100.0;

  // A force that lets go at the moment of another foot's event, by which its rate jumps, has no moment of its own where they
  // part: which comes first decides.
  void flag_order(const Row& own, double rate, double former) {
    if (std::fabs(rate - former) <= 1e-9 * std::fabs(rate)) return;
    for (int lane = 0; lane < count_; lane++) {
      if (std::fabs(own[lane] - shared_[lane]) > 1e-6 * std::fabs(own[lane])) flag(SIMULTANEOUS, lane);
    }
  }
  void note_rates() {
    former_.assign(body.feet(), 0.0);
    for (int f = 0; f < body.feet(); f++) {
      if (now(f, fraction_)) former_[f] = rate_of(body.leg[f], events[f].kind);
    }
  }

  // Friction holds a foot that did not move along the ground, and would stop any motion only in time.
  void stop_along(Jet& along) {
    for (int lane = 0; lane < count_; lane++) {
      if (along.slope[lane] != 0.0) flag(AT_THRESHOLD, lane, known_);
    }
    along = Jet(0.0);
  }
};

}  // namespace tarsus::legged
