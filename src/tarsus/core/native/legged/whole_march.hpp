// A whole walker of few legs under the one march: events found in its motion as a power series.
#pragma once
#include "legged/whole_account.hpp"
#include "legged/whole_peak.hpp"

namespace tarsus::legged {

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
    const double bound = s.laws.friction(s.body.legs[i].foot, margin, horner(strength, 0, N, time), 0.0);
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

  // Path [m] along the ground of a sliding foot that ends at ``to``; one without friction may turn on the way.
  double path_along(int i, double fraction, double to) {
    double path = 0.0, from = feet[i].u[ALONG];
    const Row& rate = rows[i].w[ALONG];
    for (int j = 1; feet[i].sense == 0.0 && j < N && nodes.tau[j] < fraction; j++) {
      if (rate[j - 1] * rate[j] >= 0.0) continue;
      double low = nodes.tau[j - 1], high = nodes.tau[j];
      while (high - low > 1e-9) {
        const double middle = 0.5 * (low + high);
        (series.number(layout.w(i, ALONG), middle).u * rate[j - 1] > 0.0 ? low : high) = middle;
      }
      const double turn = series.number(layout.u(i, ALONG), low).u;
      path += std::fabs(turn - from);
      from = turn;
    }
    return path + std::fabs(to - from);
  }

  // Move on to scaled time ``fraction`` of the step. False where a number is not finite.
  bool move_on(double h, double fraction, double reached) {
    const Energies before = energy;
    const std::vector<double> parts = notes.times.empty() ? std::vector<double>() : shares;
    alignas(64) double to[MOST_WHOLE];
    Row state[WHOLE_ROWS];
    const Row* end = &seen[layout.outputs];
    if (fraction < 1.0) {
      series.state_at(fraction, state);
      end = state;
    }
    for (int r = 0; r < layout.rows; r++) store(to + N * r, end[r]);
    if (keeps_account) WholeAccount(*this, series, h).add(fraction);
    while (notes.sampled < notes.times.size() && notes.times[notes.sampled] <= reached) sample_whole(h, fraction, before, parts);
    for (int i : body.leg) {
      LeggedFoot& foot = feet[i];
      if (foot.contact == AIR && settings.track) {
        raise(i, h, fraction);
      } else if (foot.contact == SLIPPING) {
        foot.slipped += path_along(i, fraction, to[layout.u(i, ALONG)]);
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

  // As sample.
  void sample_whole(double h, double fraction, const Energies& before, const std::vector<double>& parts) {
    const double part = std::max(std::min((notes.times[notes.sampled] - clock.time) / h, fraction), 0.0);
    Row state[WHOLE_ROWS];
    series.state_at(part, state);
    const double* now = reinterpret_cast<const double*>(state);
    for (int b = 0; b < coordinates(); b++) {
      moment.x[b] = now[layout.x(b)];
      moment.v[b] = now[layout.v(b)];
    }
    for (int i = 0; i < legs(); i++) {
      for (int d = 0; d < DIRECTIONS; d++) {
        moment.of(i, d) = {now[layout.u(i, d)], feet[i].held(d) ? 0.0 : now[layout.w(i, d)]};
      }
    }
    put_sample(fraction > 0.0 ? part / fraction : 1.0, before, parts);
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
