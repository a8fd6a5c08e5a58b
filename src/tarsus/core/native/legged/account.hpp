// Energy that every force transfers within a step, each integrated separately.
#pragma once
#include "legged/motion.hpp"

namespace tarsus::legged {

constexpr double UNSEEN = 1e-9;  // relative truncation that is negligible in an account, which closes to 1e-8
constexpr double UNSEEN_SHARE = 1e-3;  // the same for the share of one of several films, whose sum keeps the bound above

// Integral of rate dP over a stretch of scaled time whose nodes do not resolve the change of a film's momentum P, from its
// values ``low`` to ``high`` at the ends; w: the rate without it at the nodes. By parts, with p = P - high: p^2/2m - rate p at
// the start, and
// - int p dw, since w hardly changes in so short a time.
inline double film_by_parts(const Between& between, const Row& w, const Row& film, double mass, double low, double high) {
  const double first = low - high;
  return first * (0.5 * first / mass - w[0] - low / mass) -
         total((film - high) * combine(&between.slope[0][0], w) * load(between.weights));
}

// A stretch of the step, in scaled time: rows on it from rows on the step.
struct Stretch {
  double start, width;
  bool whole;
  double matrix[N][N];

  Stretch(const Legged& s, double from, double wide) : start(from), width(wide), whole(from == 0.0 && wide == 1.0) {
    if (whole) return;
    const Row x = s.nodes.times() * width + start;
    for (int j = 0; j < N; j++) {
      Row value = Row(s.between.powers[j][N - 1]);
      for (int c = N - 2; c >= 0; c--) value = value * x + s.between.powers[j][c];
      store(matrix[j], value);
    }
  }
  TARSUS_INLINE Row of(const Row& values) const { return whole ? values : combine(&matrix[0][0], values); }
};

// A leg on a stretch: its rate without the film's momentum at the nodes, displacements at the ends, and at the nodes.
struct Path {
  Row w;
  double low, high;
  Row u = Row(0.0);
};

struct Account {
  Legged& s;
  const double h;

  double integral(const Row& values) const { return total(values * load(s.between.weights)); }
  // Work of a force along a way, both at the nodes of a stretch, which is ``low`` and ``high`` at the ends: by parts, since forces change slowly where legs
  // ring. What the nodes miss of a ringing rate, next to nothing in a step, adds up over tens of thousands of periods.
  double work(const Row& force, const Row& way, double low, double high) const {
    return force[N - 1] * (high - low) - integral(combine(&s.between.slope[0][0], force) * (way - low));
  }
  bool seen(const Row& w) const { return s.nodes.truncation(w) <= UNSEEN * highest(magnitude(w)); }

  // Integral of rate share dP, with w and the film's momentum P at the nodes, ``low`` and ``high`` at the ends.
  //
  // The nodes do not resolve the change of P in a film much thinner than the way of the foot: then by parts.
  double by_film(const Row& w, const Row& film, double share, const Row& rate, double mass, double low, double high,
                 double unseen = UNSEEN) const {
    const double* slope = &s.between.slope[0][0];
    const double missed = s.nodes.truncation(film) + std::fabs(film[0] - low) + std::fabs(film[N - 1] - high);
    if (missed <= unseen * highest(magnitude(film - high))) return integral(combine(slope, film * share) * rate);
    return film_by_parts(s.between, w, film * share, mass, low * share, high * share);
  }

  // The gap of a foot in the air at an end of a stretch, where its displacement upward is known.
  TARSUS_INLINE double end_gap(int i, double up, double fraction) const {
    const Leg& leg = s.body.legs[i];
    return leg.is_tilted() || s.profile != nullptr ? gap_above_slope(i, fraction) : leg.clearance(up, 0.0);
  }
  TARSUS_APART double gap_above_slope(int i, double fraction) const { return gap_at(s, i, h, fraction).u; }

  // The same law by law, of a foot in the air; see ActingLaws::shares. Where a film of several laws is thinner than the way of the
  // foot, the nodes do not resolve the shares of the laws in its work.
  void add_shares(int i, int d, const Stretch& over, const Path& path, const Row& rate) {
    const double by = s.normal_share(i, d), low_gap = end_gap(i, path.low, over.start), high_gap = end_gap(i, path.high, over.start + over.width);
    const Leg& leg = s.body.legs[i];
    const LegRows& r = s.rows[i];
    const auto &resistive = s.laws.laws.terms[MOMENTUM], &smooth = s.laws.laws.terms[FORCE];
    size_t share = 0;
    for (size_t n = 0; n + 1 < resistive.size(); n++) {
      const Row film = over.of(s.laws.momentum_of(resistive[n], leg.foot, r.gap));
      const double low = s.laws.momentum_of(resistive[n], leg.foot, low_gap);
      const double high = s.laws.momentum_of(resistive[n], leg.foot, high_gap);
      const Row without = rate - film * (by / leg.mass);  // with the part of the rate that the other films make
      s.shares[share++] += by_film(without, film, by, rate, leg.mass, low, high, UNSEEN_SHARE);
    }
    const Row now = s.nodes.times() * h + s.clock.time;
    for (size_t n = 0; n + 1 < smooth.size(); n++) {
      const Row force = s.laws.force_of(smooth[n], leg.foot, r.gap, r.rate, s.volts(leg.foot), now);
      s.shares[share++] += integral(over.of(force) * rate) * (by * h * over.width);
    }
  }

  // Energies of a foot that nothing holds in direction d, over a stretch.
  void add(int i, int d, const Stretch& over, const Path& path) {
    const Leg& leg = s.body.legs[i];
    const LeggedFoot& foot = s.feet[i];
    const LegRows& r = s.rows[i];
    const double span = h * over.width;
    Row rate = path.w;
    if (foot.filmed() && (d == UP || s.profile != nullptr)) {  // along a level facet nothing, but by what turns it
      const double share = s.film_share(i, d);
      const Row film = over.of(r.film);
      rate += film * (share / leg.mass);
      const double low = s.film(i, end_gap(i, path.low, over.start));
      const double high = s.film(i, end_gap(i, path.high, over.start + over.width));
      s.energy.film -= by_film(path.w, film, share, rate, leg.mass, low, high);
    }
    const bool acted = (d == UP || leg.is_tilted()) && foot.contact == AIR;  // by what acts along the normal of the ground
    if (acted && leg.foot >= 0 && !s.shares.empty()) add_shares(i, d, over, path, rate);
    const Row across = rate - over.of(leg.hip[d].motion(s.at.v));
    s.energy.damping += leg.damping[d] * integral(across * across) * span;
    s.energy.work += work(over.of(r.load[d]), path.u, path.low, path.high);
    if (acted && foot.force) s.energy.smooth += integral(over.of(r.smooth) * rate) * (s.normal_share(i, d) * span);
    if (leg.turned) s.energy.damping -= 2.0 * leg.cross_damping * integral(across * over.of(leg.hip[UP].motion(s.at.v))) * span;
    if (d != UP && foot.contact == SLIPPING) {
      s.energy.friction += s.any_way(i) ? integral(over.of(r.bound * r.way[d]) * rate) * span : integral(over.of(r.bound) * rate) * foot.sense[d] * span;
    }
  }

  // The exact motion of a leg over a stretch.
  Path path(int i, int d, const Stretch& over) const {
    Path out;
    for (int n = 0; n < N; n++) {
      const Motion at = leg_at(s, i, d, h, over.start + s.nodes.tau[n] * over.width);
      out.w.set(n, at.w);
      out.u.set(n, at.u);
      out.high = at.u;
      if (n == 0) out.low = at.u;
    }
    return out;
  }

  // ``end``: where the body is then.
  void of_body(const Stretch& over, const Moment& end) {
    const int nb = s.coordinates();
    const std::vector<double>& within = s.body.damping;
    const bool damped = std::any_of(within.begin(), within.end(), [](double c) { return c != 0.0; });
    for (int b = 0; b < nb; b++) {
      Row push = Row(-s.body.weight[b]);
      for (int d = 0; d < s.body.drives; d++) {
        if (s.body.load[d * nb + b] != 0.0) push += s.channels[d] * s.body.load[d * nb + b];
      }
      s.energy.work += work(over.of(push), over.of(s.at.x[b]), s.x[b], end.x[b]);
      if (!damped) continue;
      Row drag = Row(0.0);
      for (int c = 0; c < nb; c++) drag += s.at.v[c] * within[b * nb + c];
      s.energy.damping += integral(over.of(drag) * over.of(s.at.v[b])) * h * over.width;
    }
  }

  // A leg over the step up to the end of ``over``, where it is at displacement ``end``.
  void of_leg(int i, int d, const Stretch& over, double end) {
    const Leg& leg = s.body.legs[i];
    const LeggedFoot& foot = s.feet[i];
    if (foot.held(d)) {
      const Row rate = over.of(leg.hip[d].motion(s.at.v));
      s.energy.damping += leg.damping[d] * integral(rate * rate) * h * over.width;
      if (leg.turned && d == ALONG) {
        s.energy.damping += 2.0 * leg.cross_damping * integral(rate * over.of(leg.hip[UP].motion(s.at.v))) * h * over.width;
      }
      return;
    }
    const Row& w = s.rows[i].w[d];
    if (seen(w)) return add(i, d, over, {over.of(w), foot.u[d], end, over.of(s.rows[i].u[d])});
    // a fast decay at the start that the nodes do not resolve is integrated on stretches that halve towards the start
    const double fast = s.tables.rate[leg.kind[d]] * h;
    Stretch rest = over;
    Path here = path(i, d, rest);
    while (fast * rest.width >= 1.0 && !seen(here.w)) {
      const double half = 0.5 * rest.width;
      const Stretch later(s, half, half);
      add(i, d, later, path(i, d, later));
      rest = Stretch(s, 0.0, half);
      here = path(i, d, rest);
    }
    add(i, d, rest, here);
  }
};

// Add the energies of the step up to scaled time ``fraction``, where the legs are as in ``end``.
inline void add_energies(Legged& s, double h, double fraction, Moment& end) {
  Account account{s, h};
  const Stretch over(s, 0.0, std::min(fraction, 1.0));
  account.of_body(over, end);
  for (int i = 0, legs = s.legs(); i < legs; i++) {
    for (int d = 0; d < s.directions(); d++) account.of_leg(i, d, over, end.of(i, d).u);
  }
}

}  // namespace tarsus::legged
