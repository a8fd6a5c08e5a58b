// Energy that every force passes on within a step, each integrated for itself.
#pragma once
#include "legged_motion.hpp"

namespace tarsus {

constexpr double UNSEEN = 1e-9;  // relative truncation that an account, which closes to 1e-8, may pass over

// A stretch of the step, in scaled time: rows on it from rows on the step.
struct Stretch {
  double start = 0.0, width = 1.0;
  double matrix[N][N];

  Stretch(const Legged& s, double from, double wide) : start(from), width(wide) {
    if (whole()) return;
    for (int j = 0; j < N; j++) {
      const Row x = s.nodes.times() * width + start;
      Row value = Row(s.between.powers[j][N - 1]);
      for (int c = N - 2; c >= 0; c--) value = value * x + s.between.powers[j][c];
      store(matrix[j], value);
    }
  }
  bool whole() const { return start == 0.0 && width == 1.0; }
  Row of(const Row& values) const { return whole() ? values : combine(&matrix[0][0], values); }
};

struct Account {
  Legged& s;
  const double h;

  double integral(const Row& values) const { return total(values * load(s.between.weights)); }

  // Integral of rate dP, with w and the film's momentum P at the nodes, ``low`` and ``high`` at the ends.
  //
  // A film much thinner than the way of the foot changes P where the nodes do not see it. Then by parts, with p = P - high:
  // p^2/2m - rate p at the start, and - int p dw, for w hardly changes in so short a time.
  double by_film(const Row& w, const Row& film, const Row& rate, double mass, double low, double high) const {
    const double* slope = &s.between.slope[0][0];
    const double missed = s.nodes.truncation(film) + std::fabs(film[0] - low) + std::fabs(film[N - 1] - high);
    if (missed <= UNSEEN * highest(magnitude(film - high))) return integral(combine(slope, film) * rate);
    const double first = low - high;
    return first * (0.5 * first / mass - w[0] - low / mass) - integral((film - high) * combine(slope, w));
  }

  // What a foot that nothing holds in direction d passes on over a stretch.
  void of_free(int i, int d, const Stretch& over) {
    const Leg& leg = s.body.legs[i];
    const Foot& foot = s.feet[i];
    const LegRows& r = s.rows[i];
    const double span = h * over.width;
    Row w = r.w[d];
    double low = r.u[d][0], high = r.u[d][N - 1];
    if (!over.whole()) {
      for (int n = 0; n < N; n++) {
        const Motion at = leg_at(s, i, d, h, over.start + s.nodes.tau[n] * over.width);
        w.set(n, at.w);
        high = at.u;
        if (n == 0) low = high;
      }
    }
    Row rate = w;
    if (d == UP && foot.filmed()) {
      const Row film = over.of(r.film);
      rate += film * (1.0 / leg.mass);
      low = s.laws.momentum(leg.foot, low + leg.gap);
      high = s.laws.momentum(leg.foot, high + leg.gap);
      s.energy.film -= by_film(w, film, rate, leg.mass, low, high);
    }
    const Row across = rate - over.of(leg.hip[d].motion(s.at.v));
    s.energy.damping += leg.damping[d] * integral(across * across) * span;
    s.energy.work += integral(over.of(r.load[d]) * rate) * span;
    if (d == UP && foot.force) s.energy.smooth += integral(over.of(r.smooth) * rate) * span;
    if (d == ALONG && foot.contact == SLIPPING) {
      s.energy.friction += integral(over.of(r.bound) * rate) * foot.sense * span;
    }
  }

  void of_body(const Stretch& over) {
    const int nb = s.coordinates();
    for (int b = 0; b < nb; b++) {
      Row push = Row(-s.body.weight[b]);
      for (int d = 0; d < s.body.drives; d++) push += s.channels[d] * s.body.load[d * nb + b];
      s.energy.work += integral(over.of(push) * over.of(s.at.v[b])) * h * over.width;
    }
  }

  // A leg over the step up to ``fraction``, which ``over`` stands for.
  void of_leg(int i, int d, double fraction, const Stretch& over) {
    const Leg& leg = s.body.legs[i];
    const Row& w = s.rows[i].w[d];
    if (s.feet[i].held(d)) {
      const Row rate = over.of(leg.hip[d].motion(s.at.v));
      s.energy.damping += leg.damping[d] * integral(rate * rate) * h * fraction;
      return;
    }
    // a fast decay at the start that the nodes do not see is taken on stretches that halve towards it
    const double fast = s.tables.rate[leg.kind[d]] * h * fraction;
    if (fast < 1.0 || s.nodes.truncation(w) <= UNSEEN * highest(magnitude(w))) return of_free(i, d, over);
    const int halvings = 1 + int(std::log2(fast));
    double start = 0.0;
    for (int n = halvings; n >= 0; n--) {
      const double end = fraction * std::ldexp(1.0, -n);
      of_free(i, d, Stretch(s, start, end - start));
      start = end;
    }
  }
};

// Add the energies of the step up to scaled time ``fraction``.
inline void add_energies(Legged& s, double h, double fraction) {
  Account account{s, h};
  const Stretch over(s, 0.0, std::min(fraction, 1.0));
  account.of_body(over);
  for (int i = 0; i < s.legs(); i++) {
    for (int d = 0; d < DIRECTIONS; d++) account.of_leg(i, d, fraction, over);
  }
}

}  // namespace tarsus
