// A whole walker of few legs under the one march: its motion within a step as a power series, events found there.
#pragma once
#include "legged_whole.hpp"
#include "legged_whole_peak.hpp"

namespace tarsus::legged {

constexpr int SERIES_TERMS = 40;
constexpr double SERIES_REACH = 3.0;  // largest rate times time over which the series keeps 14 digits

// State of the whole walker in the step being made, in powers of the scaled time from ``center`` on.
class Series {
 public:
  explicit Series(const Whole& s) : s_(s), size_(s.layout.size), rows_(s.layout.rows) {}

  // A step of class k was made.
  void restart(int k) {
    k_ = k;
    h_ = s_.tables.lengths[k];
    terms_ = 0;
    known_ = false;
  }
  // Have the series hold from scaled time ``low`` to ``high``.
  void cover(double low, double high) {
    if (covers(low) && covers(high)) return;
    expand(covered_from_start(high) ? 0.0 : low, high);
  }
  // State at a scaled time.
  void state_at(double time, Row* out) {
    cover_near(time);
    const double x = time - center_;
    for (int r = 0; r < rows_; r++) out[r] = term_[terms_ - 1][r];
    for (int c = terms_ - 2; c >= 0; c--) {
      for (int r = 0; r < rows_; r++) out[r] = out[r] * x + term_[c][r];
    }
  }
  // A number of the state and its derivative by the scaled time.
  Motion number(int n, double time) {
    cover_near(time);
    const double x = time - center_;
    double value = at(terms_ - 1, n), slope = 0.0;
    for (int c = terms_ - 2; c >= 0; c--) {
      slope = slope * x + value;
      value = value * x + at(c, n);
    }
    return {value, slope};
  }

 private:
  const Whole& s_;
  const int size_, rows_;
  int k_ = 0, terms_ = 0;
  double h_ = 0.0, center_ = 0.0;
  bool known_ = false;                 // whether the powers below are those of the step
  double power_[MOST_INPUTS][N];       // of every input, in powers of the scaled time
  Row term_[SERIES_TERMS][WHOLE_ROWS];

  double rate() const { return s_.whole->state(s_.state).system.rate * h_; }
  bool covered_from_start(double time) const { return time * rate() <= SERIES_REACH; }
  bool covers(double time) const { return terms_ > 0 && std::fabs(time - center_) * rate() <= reach_; }
  double at(int c, int n) const { return reinterpret_cast<const double*>(&term_[c][0])[n]; }
  double reach_ = 0.0;

  void cover_near(double time) {
    if (!covers(time)) expand(covered_from_start(time) ? 0.0 : time, time + SERIES_REACH / rate());
  }

  void find_powers() {
    known_ = true;
    const WholeLayout& of = s_.layout;
    for (int b = 0; b < of.inputs; b++) std::fill(power_[b], power_[b] + N, 0.0);
    power_[0][0] = s_.gravity;
    for (int d = 0; d < of.drives; d++) {
      if (s_.level[d]) {
        power_[of.drive(d)][0] = s_.channels[d][0];
      } else {
        store(power_[of.drive(d)], s_.powers(s_.channels[d]));
      }
    }
    for (int b = of.first_slot; b < of.inputs; b++) {
      if (s_.acts[b]) store(power_[b], s_.powers(s_.force[b]));
    }
  }

  bool moves(int b) const { return b < s_.layout.first_slot ? b > 0 && !s_.level[b - 1] : s_.acts[b]; }

  // The series from a state on, the inputs being powers of the time from there, as far as ``span``.
  void develop(const Row* from, double (*power)[N], double span) {
    const WholeState& equations = s_.whole->state(s_.state);
    const double x = std::min(rate() * span, SERIES_REACH);
    terms_ = N + 2;
    double size = 1.0;
    for (int c = 1; c < terms_; c++) size *= x / c;
    for (; size > 1e-18 && terms_ < SERIES_TERMS; terms_++) size *= x / terms_;
    for (int r = 0; r < rows_; r++) term_[0][r] = from[r];
    for (int c = 0; c + 1 < terms_; c++) {
      Row next[WHOLE_ROWS];
      for (int r = 0; r < rows_; r++) next[r] = Row(0.0);
      apply(equations.flow.data(), size_, rows_, term_[c], next);
      for (int b = 0; c < N && b < s_.layout.inputs; b++) {
        if (c > 0 && !moves(b)) continue;
        for (int r = 0; r < rows_; r++) next[r] += equations.input[b * rows_ + r] * power[b][c];
      }
      for (int r = 0; r < rows_; r++) term_[c + 1][r] = next[r] * (h_ / (c + 1));
    }
    reach_ = x * (1.0 + 1e-12);
  }

  // Over a whole step of a shorter class, ``width`` of this one.
  void by_table(int k, double width, double (*power)[N], Row* state) {
    const WholeLayout& of = s_.layout;
    const WholeStep& step = s_.step_of(k);
    Row sum[MOST_WIDTH];
    double constant[MOST_INPUTS];
    for (int r = 0; r < of.width; r++) sum[r] = Row(0.0);
    s_.add_columns(step, 0, reinterpret_cast<const double*>(state), size_, sum);
    for (int b = 0; b < of.first_slot; b++) constant[b] = moves(b) ? 0.0 : power[b][0];
    s_.add_columns(step, of.constant(0), constant, of.first_slot, sum);
    const Row time = s_.nodes.times() * width;
    for (int b = 1; b < of.inputs; b++) {
      if (!moves(b)) continue;
      Row value = Row(power[b][N - 1]);
      for (int c = N - 2; c >= 0; c--) value = value * time + power[b][c];
      s_.add_columns(step, of.nodal(b), reinterpret_cast<const double*>(&value), N, sum);
    }
    for (int r = 0; r < rows_; r++) state[r] = sum[of.outputs + r];
  }

  void expand(double center, double high) {
    if (!known_) find_powers();
    Row from[WHOLE_ROWS];
    for (int r = 0; r < rows_; r++) from[r] = load(s_.y + N * r);
    if (center == 0.0) {
      center_ = 0.0;
      return develop(from, power_, high);
    }
    double power[MOST_INPUTS][N];
    std::copy(power_[0], power_[0] + s_.layout.inputs * N, power[0]);
    const auto go_on = [&](double by) {
      for (int b = 1; b < s_.layout.inputs; b++) {
        if (moves(b)) shift(power[b], by);
      }
    };
    double left = center, width = 0.5;
    for (int k = k_ + 1; rate() * left > SERIES_REACH && k < s_.tables.classes(); k++, width *= 0.5) {
      if (width > left) continue;
      by_table(k, width, power, from);
      left -= width;
      go_on(width);
    }
    if (left > 0.0) {
      center_ = center - left;
      develop(from, power, left);
      state_at(center, from);
      go_on(left);
    }
    center_ = center;
    develop(from, power, high - center);
  }
};

// The event function of a foot in a whole walker, as EventFunction.
struct WholeEvent {
  Whole& s;
  Series& series;
  const int i;
  const Happening kind;
  const double h;
  double smooth[N], strength[N];  // of a held foot, in powers of the scaled time

  WholeEvent(Whole& state, Series& motion, int leg, const Bracket& bracket, double step)
      : s(state), series(motion), i(leg), kind(bracket.kind), h(step) {
    series.cover(bracket.low, bracket.high);
    if (kind == TOUCH || kind == STOP) return;
    store(smooth, s.powers(s.rows[i].smooth));
    store(strength, s.powers(s.rows[i].strength));
  }
  double at(double time, double& slope) const {
    if (kind == TOUCH) {
      const Motion now = series.number(s.layout.u(i, UP), time);
      slope = now.w;
      return now.u + s.body.legs[i].gap;
    }
    if (kind == STOP) return s.feet[i].sense * series.number(s.layout.w(i, ALONG), time).u;
    Row state[WHOLE_ROWS];
    series.state_at(time, state);
    const double margin = horner(smooth, 0, N, time) - seen(UP, state, time);
    if (kind == PULL_OFF) return margin + s.settings.force_zero;
    const double bound = s.laws.friction(s.body.legs[i].foot, margin, horner(strength, 0, N, time));
    const double along = seen(ALONG, state, time);
    return (kind == SLIP_UP ? bound - along : bound + along) + s.settings.force_zero;
  }
  // Force of the structure on a held foot [N].
  double seen(int d, const Row* state, double time) const {
    const WholeLayout& of = s.layout;
    const WholeSystem& system = s.whole->state(s.state).system;
    const double* value = reinterpret_cast<const double*>(state);
    const int out = of.seen(i, d == UP ? 0 : 1);
    double sum = system.d[out * of.inputs] * s.gravity;
    for (int n = 0; n < of.size; n++) sum += system.c[out * of.size + n] * value[n];
    for (int c = 0; c < of.drives; c++) {
      const double by = system.d[out * of.inputs + of.drive(c)];
      if (by != 0.0) sum += by * (s.level[c] ? s.channels[c][0] : s.polynomial_at(s.channels[c], time));
    }
    return sum;
  }
};

struct WholeMarch : Whole {
  Series series;

  template <class... Given>
  explicit WholeMarch(Given&&... given) : Whole(std::forward<Given>(given)...), series(*this) {}
  WholeMarch(const WholeMarch&) = delete;

  // As first_of_foot.
  Bracket first_event(int i, double h, double limit) {
    const auto gap_at = [&](double time) {
      Motion now = series.number(layout.u(i, UP), time);
      now.u += body.legs[i].gap;
      return now;
    };
    const Candidates found = candidates(*this, i, h, limit, gap_at);
    Bracket best = {2.0, 2.0, NOTHING};
    for (int n = 0; n < found.count; n++) {
      const Bracket& one = found.some[n];
      if (one.low > std::min(best.low, limit)) continue;
      double at = 0.0;
      if (one.high > 0.0) {
        WholeEvent function(*this, series, i, one, h);
        at = refine(*this, i, one, function);
      }
      if (at > limit || at >= best.low) continue;
      if ((one.kind == SLIP_UP || one.kind == SLIP_DOWN) && at > 0.0 && no_force_along(i, at, h)) continue;
      if (at == 0.0 && (one.kind == SLIP_UP || one.kind == SLIP_DOWN) && nothing_along(*this, i, 0.0)) continue;
      best = {at, at, one.kind};
    }
    return best;
  }
  bool no_force_along(int i, double time, double h) {
    const WholeEvent function(*this, series, i, {time, time, SLIP_UP}, h);
    Row state[WHOLE_ROWS];
    series.state_at(time, state);
    return std::fabs(function.seen(ALONG, state, time)) <= settings.force_zero;
  }

  // Move on to scaled time ``fraction`` of the step. False where a number is not finite.
  bool move_on(double h, double fraction, double reached) {
    alignas(64) double to[MOST_WHOLE];
    Row state[WHOLE_ROWS];
    const Row* end = &seen[layout.outputs];
    if (fraction < 1.0) {
      series.state_at(fraction, state);
      end = state;
    }
    for (int r = 0; r < layout.rows; r++) store(to + N * r, end[r]);
    for (int i : body.leg) {
      LeggedFoot& foot = feet[i];
      if (foot.contact == AIR && settings.track) {
        raise(i, h, fraction);
      } else if (foot.contact == SLIPPING) {
        foot.slipped += std::fabs(to[layout.u(i, ALONG)] - foot.u[ALONG]);
      }
    }
    raise_body(h, fraction);
    double sum = 0.0;
    for (int b = 0; b < coordinates(); b++) sum += (x[b] = to[layout.x(b)]) + (v[b] = to[layout.v(b)]);
    for (int i = 0; i < legs(); i++) {
      LeggedFoot& foot = feet[i];
      foot.start = AS_IT_COMES;
      for (int d = 0; d < DIRECTIONS; d++) {
        if (foot.held(d)) continue;
        sum += (foot.u[d] = to[layout.u(i, d)]) + (foot.w[d] = to[layout.w(i, d)]);
      }
    }
    clock.time = reached;
    return std::isfinite(sum);
  }

  // As raise_apex.
  void raise(int i, double h, double fraction) {
    Apex& apex = feet[i].apex;
    const Row &gap = rows[i].gap, rate = rows[i].rate * h;
    apex.integral += (fraction >= 1.0 ? total(gap * load(between.weights)) : Hermite(*this, gap, rate).integral(*this, fraction)) * h;
    const Peak peak = peak_of(*this, gap, rate, 1.0, fraction, apex.gap);
    if (peak.value <= apex.gap) return;
    apex.gap = peak.value;
    apex.time = clock.time + peak.at * h;
  }
  // As note_heights.
  void raise_body(double h, double fraction) {
    const Row &height = at.x[1], rate = at.v[1] * h;
    const double margin = 0.22 * highest(magnitude(rate));
    if (lowest(height) - margin < lowest_body) {
      lowest_body = std::min(lowest_body, -peak_of(*this, height, rate, -1.0, fraction, -lowest_body).value);
    }
    if (highest(height) + margin > highest_body) {
      highest_body = std::max(highest_body, peak_of(*this, height, rate, 1.0, fraction, highest_body).value);
    }
  }

  Code step() {
    const Player::Kink kink = player.next_kink(clock.time);
    const double goal = std::min(settings.end, clock.mark);
    const double left = std::min(kink.left, goal - clock.time);
    rebase();
    enter_step();
    const Chosen chosen = choose(left, kink.reach, coarsest_whole(), [this](int k) { return try_whole(k); });
    if (chosen.code != GOING_ON) return chosen.code;
    step_class = chosen.k;
    series.restart(chosen.k);
    const double h = tables.lengths[chosen.k], limit = std::min(1.0, left / h);
    double first = 2.0;
    for (int f = 0; f < body.feet(); f++) {
      events[f] = first_event(body.leg[f], h, limit);
      first = std::min(first, events[f].low);
    }
    const double fraction = std::min(first, limit);
    const double reached = reached_at(h, first, limit, left, goal);
    if (fraction > 0.0 && !move_on(h, fraction, reached)) return NOT_FINITE;
    int kind = 0;
    if (first <= limit) {
      Nobody nobody;
      kind = happen(first, nobody);
    }
    // the eighth derivative of a film P ~ 1/(g + g0)^2 grows as P^5 where the foot goes on as it does
    Chosen expected = chosen;
    if (first > limit && growth > 0.0) expected.made.error *= std::pow(std::min(growth, 8.0), 5.0);
    adapt(expected, fraction < 1.0 || first <= limit, kind);
    return GOING_ON;
  }
};

}  // namespace tarsus::legged
