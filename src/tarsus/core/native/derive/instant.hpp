// One moment at which something happens to feet: the maps of its events, on Jets that move with the moment.
#pragma once
#include "march/march.hpp"
#include "march/rules.hpp"
#include "derive/tangent.hpp"
#include "derive/structure.hpp"

namespace tarsus::modal {

// Numbers of an event; when: its time as it is told.
struct EventNumbers {
  Jet when = Jet(0.0), before = Jet(0.0), after = Jet(0.0), pull = Jet(0.0), strength = Jet(0.0), energy = Jet(0.0),
      adhesion = Jet(0.0);
  bool doubtful = false;  // the decision between bounce and capture is within CLOSE of its threshold
};

class Instant {
 public:
  typedef double* ContactMode::*Array;

  Book& book;
  const Sizes sizes;
  const ContactMode* mode = nullptr;
  Jet time = Jet(0.0);
  std::vector<Jet> w, drives, since;  // flowing state; values of the channels; begin of the contacts [s]

  Instant(Book& b, LawTangents& laws, const Settings& settings, std::vector<Jet> sources, const std::vector<Structural>& structural)
      : book(b), sizes(b.sizes), since(sizes.feet, Jet(0.0)), laws_(laws), settings_(settings), sources_(std::move(sources)),
        structural_(structural) {}

  // Displacements and velocities; the film momenta of the free feet in them, that of ``struck`` at the ground.
  std::vector<Jet> place(int struck = -1) {
    const std::vector<Jet> y = modal(struck);
    const int n2 = 2 * sizes.coordinates;
    std::vector<Jet> out;
    for (int r = 0; r < n2; r++) out.push_back(along(&ContactMode::to_physical, r, y) + biased(&ContactMode::bias_offset, n2, r));
    return out;
  }

  // Project displacements and velocities on a contact mode.
  void enter(const ContactMode& to, const std::vector<Jet>& from) {
    go_to(to);
    const int n2 = 2 * sizes.coordinates;
    std::vector<Jet> off;
    for (int r = 0; r < n2; r++) off.push_back(from[r] - biased(&ContactMode::bias_offset, n2, r));
    w.assign(sizes.state(), Jet(0.0));
    for (int k = 0; k < sizes.state(); k++) {
      for (int r = 0; r < n2; r++) w[k] = w[k] + product(&ContactMode::from_physical, size_t(k) * n2 + r, off[r]);
    }
    w = modal(-1, -1.0);
  }

  Jet gap_of(int i) const { return along(&ContactMode::outputs, i, w) + biased(&ContactMode::bias_feed, 2 * sizes.feet, i); }
  Jet rate_of(int i, const std::vector<Jet>& y) const { return along(&ContactMode::outputs, sizes.feet + i, y); }

  // Gap rate [m/s] of a foot at the ground.
  double rate_at_ground(int i) { return rate_of(i, modal(i)).value; }

  // Take the state along to a moment that moves otherwise.
  void shift_moment(const Row& by) {
    const int m = sizes.feet;
    const std::vector<int> acting = acting_inputs(*mode, laws_.plain());
    const std::vector<Jet> y = modal(-1);
    std::vector<double> values(sizes.inputs(), 0.0), plain, sources, rate;
    for (const Jet& one : w) plain.push_back(one.value);
    for (const Jet& one : sources_) sources.push_back(one.value);
    for (int i : acting) {
      if (i < m) {
        values[i] = laws_.momentum(i, gap_of(i)).value;
      } else if (i < 2 * m) {
        values[i] = laws_.force(i - m, gap_of(i - m), rate_of(i - m, y), volts(i - m), time).value;
      } else {
        values[i] = drives[i - 2 * m].value;
      }
    }
    rate_of_state(*mode, acting, plain, values, sources, rate);
    for (int k = 0; k < sizes.state(); k++) w[k] = jet(w[k].value, slope_of(w[k]) + by * rate[k]);
    time = jet(time.value, slope_of(time) + by);
  }

  // Whether a foot that lands and one that has just bounced leave each other's velocity as it is.
  bool independent(int foot, int other) const {
    if (mode->is_held[other]) return false;
    return std::fabs(mode->rate_by_jump(other, foot)) <= 1e-12;
  }

  // What an event of the log does; ``told``: whether it tells a strength (a foot torn off by an impact has none).
  EventNumbers apply(EventKind kind, int foot, bool told) {
    if (kind == RELEASE) {
      EventNumbers out;
      out.when = time;
      if (told) out.pull = out.strength = laws_.value(STRENGTH, foot, {time - since[foot]});
      change(foot, -1);
      return out;
    }
    return kind == CONTACT_AT_START ? settle(foot) : strike(kind, foot);
  }

  // How a contact mode's outputs and the like move with rest gaps and gravity.
  Jet biased(Array unit, int count, int row) const {
    Jet sum(0.0);
    for (int q = 0; q < sizes.sources(); q++) sum = sum + product(unit, size_t(q) * count + row, sources_[q]);
    return sum;
  }

  // A number of the contact mode's arrays, with its derivatives by the structure.
  Jet entry(Array array, size_t at) const {
    Jet out((mode->*array)[at]);
    for (size_t n = 0; n < derived_.size(); n++) out.slope[structural_[n].lane] = (derived_[n]->*array)[at];
    return out;
  }
  Jet product(Array array, size_t at, const Jet& by) const {
    return derived_.empty() ? by * (mode->*array)[at] : by * entry(array, at);
  }

 private:
  LawTangents& laws_;
  const Settings& settings_;
  std::vector<Jet> sources_;
  const std::vector<Structural>& structural_;
  std::vector<const ContactMode*> derived_;  // rows of the mode by each number of the structure

  void go_to(const ContactMode& to) {
    mode = &to;
    derived_.clear();
    for (const Structural& one : structural_) derived_.push_back(one.book->mode(to).rows.get());
  }
  Jet along(Array rows, int row, const std::vector<Jet>& x) const {
    Jet sum(0.0);
    for (int k = 0; k < sizes.state(); k++) sum = sum + product(rows, size_t(row) * sizes.state() + k, x[k]);
    return sum;
  }
  Jet volts(int i) const {
    const int64_t c = laws_.laws.volts[i];
    return c < 0 ? Jet(0.0) : drives[c];
  }
  void shift(Array rows, int row, const Jet& by) { shift(w, rows, row, by); }
  void shift(std::vector<Jet>& to, Array rows, int row, const Jet& by) const {
    for (int k = 0; k < sizes.state(); k++) to[k] = to[k] + product(rows, size_t(row) * sizes.state() + k, by);
  }

  std::vector<Jet> modal(int struck, double sign = 1.0) {
    std::vector<Jet> y = w;
    for (int i : mode->free) {
      if (!laws_.has(i, HAS_MOMENTUM)) continue;
      shift(y, &ContactMode::beta, i, laws_.momentum(i, i == struck ? Jet(0.0) : gap_of(i)) * sign);
    }
    return y;
  }

  Jet new_strength(int i) { return laws_.has(i, HAS_LATCH) ? laws_.value(STRENGTH, i, {Jet(0.0)}) : Jet(0.0); }

  // As rate_by_jump of ContactMode.
  Jet rate_by_jump(int foot, int other) const {
    Jet sum(0.0);
    for (int k = 0; k < sizes.state(); k++) {
      const size_t row = size_t(sizes.feet + other) * sizes.state() + k, jump = size_t(foot) * sizes.state() + k;
      sum = sum + entry(&ContactMode::outputs, row) * entry(&ContactMode::jump, jump);
    }
    return sum;
  }

  // As pull_if_held of modal/contact.hpp.
  Jet pull_if_held(int foot, const std::vector<Jet>& y) {
    const int m = sizes.feet;
    const size_t feed = size_t(foot) * sizes.inputs();
    Jet pull = along(&ContactMode::held_rows, foot, y) + biased(&ContactMode::bias_held, m, foot);
    const Jet stop = -rate_of(foot, y);
    for (int d = 0; d < sizes.drives; d++) pull = pull + product(&ContactMode::held_feed, feed + 2 * m + d, drives[d]);
    if (laws_.has(foot, HAS_FORCE)) pull = pull + laws_.force(foot, Jet(0.0), Jet(0.0), volts(foot), time);
    for (int k : mode->free) {
      const Jet factor = entry(&ContactMode::held_feed, feed + m + k);
      if (k == foot || (factor.value == 0.0 && derived_.empty())) continue;
      const Jet rate = rate_of(k, y) + stop * rate_by_jump(foot, k), gap = gap_of(k);
      if (laws_.has(k, HAS_MOMENTUM)) pull = pull + rate * laws_.momentum_slope(k, gap, settings_.probe) * factor;
      if (laws_.has(k, HAS_FORCE)) pull = pull + laws_.force(k, gap, rate, volts(k), time) * factor;
    }
    return pull;
  }

  // To the contact mode with one foot more or less on the ground.
  void change(int foot, int struck) {
    const std::vector<Jet> from = place(struck);
    enter(book.toggled(*mode, foot), from);
  }

  // A foot that lies on the ground.
  EventNumbers settle(int foot) {
    EventNumbers out;
    out.when = time;
    out.pull = pull_if_held(foot, modal(-1));
    out.strength = new_strength(foot);
    since[foot] = time;
    change(foot, -1);
    return out;
  }

  EventNumbers strike(EventKind kind, int foot) {
    const std::vector<Jet> y = modal(foot);
    const Jet rate = rate_of(foot, y), speed = -rate, after = laws_.value(REBOUND, foot, {speed});
    EventNumbers out;
    out.when = time;
    out.before = speed;
    out.pull = pull_if_held(foot, y);
    out.strength = new_strength(foot);
    const Jet mobility = entry(&ContactMode::mobility, foot);
    const Jet lost = (speed * speed - after * after) * 0.5 / mobility, kept = after * after * 0.5 / mobility;
    out.doubtful = is_close(foot, after, out, printed_pull(foot, rate.value + after.value, y));
    if (kind == BOUNCE) {
      out.after = after;
      out.energy = lost + follow(foot, speed, after, y);
      shift(&ContactMode::jump, foot, after - rate);
      return out;
    }
    if (kind == CAPTURE && laws_.has(foot, HAS_LATCH)) out.adhesion = kept;
    out.energy = lost + kept;
    if (kind == REST) {  // as rest_time
      out.when = time - after * 2.0 / (out.pull * mobility) / (1.0 - after / speed);
    }
    since[foot] = time;
    change(foot, foot);
    return out;
  }

  // The pull by (2.13) as printed, of a foot whose velocity an impact changes by so much.
  double printed_pull(int foot, double change, const std::vector<Jet>& y) const {
    const int m = sizes.feet;
    const double* feed = mode->printed_feed + size_t(foot) * sizes.inputs();
    double pull = along(&ContactMode::printed, foot, y).value + biased(&ContactMode::bias_printed, m, foot).value;
    for (int d = 0; d < sizes.drives; d++) pull += drives[d].value * feed[2 * m + d];
    return pull + mode->printed_damping[foot] * change;
  }

  // Whether the decision of landing_kind is within rounding of its threshold.
  bool is_close(int foot, const Jet& after, const EventNumbers& at, double printed) {
    const auto close = [](double a, double b) { return std::fabs(a - b) < CLOSE * (std::fabs(a) + std::fabs(b)); };
    if (laws_.has(foot, RESTITUTES_FIRST)) {
      const double excess = laws_.value(EXCESS, foot, {after}).value;
      if (std::fabs(excess) < CLOSE * std::fabs(after.value)) return true;
      if (excess > 0.0) return false;
    } else if (laws_.has(foot, PULL_AS_PRINTED)) {
      return close(printed, std::max(at.strength.value, 0.0));
    } else if (!laws_.has(foot, HAS_LATCH)) {
      return false;
    }
    return close(at.pull.value, at.strength.value);
  }

  // As follow_impact of modal/contact.hpp.
  Jet follow(int foot, const Jet& speed, const Jet& after, const std::vector<Jet>& y) {
    const Jet skew = entry(&ContactMode::skew, foot);
    if (skew.value == 0.0 || speed.value == 0.0) return Jet(0.0);
    const Jet e = after / speed;
    Jet alpha(1.0), beta = (e + 1.0) * skew;
    if (!laws_.has(foot, MAP_AS_IS)) {
      const Jet theta = passive(e, skew);
      alpha = cosine(theta);
      beta = square_root(maximum(1.0 - e * e, Jet(0.0))) * sine(theta);
    }
    const Jet before = along(&ContactMode::side_rate, foot, y);
    const Jet then = alpha * before + beta * speed / square_root(entry(&ContactMode::mobility, foot));
    shift(&ContactMode::side, foot, then - before);
    return (before * before - then * then) * 0.5;
  }

  // passive_angle with its derivative: one step of Newton's method on Jets from its value.
  static Jet passive(const Jet& e, const Jet& skew) {
    const Jet theta(passive_angle(e.value, skew.value));
    if (e.value >= 1.0) return theta;
    const Jet wanted = (e + 1.0) * skew * square_root(1.0 - e * e), s = sine(theta), c = cosine(theta);
    const Jet f = s * (1.0 - e * e * c) - wanted * c;
    const double ee = e.value * e.value;
    return jet(theta.value, -slope_of(f) / (c.value * (1.0 - ee * c.value) + ee * s.value * s.value + wanted.value * s.value));
  }
};

}  // namespace tarsus::modal
