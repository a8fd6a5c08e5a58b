// Energies and samples of a whole walker within a step, by its motion at any moment.
//
// Every force is integrated for itself by quadrature with the nodes of a step, on pieces that resolve the oscillations and that halve
// towards the start as far as something decays there. What drove the motion is what is integrated, so that the account closes to the
// quadrature's own error.
#pragma once
#include "legged/whole_series.hpp"

namespace tarsus::legged {

constexpr double PIECE = 1.0;  // radians of an oscillation in a piece at most: the quadrature of its square is good to 1e-11

class WholeAccount {
 public:
  WholeAccount(Whole& s, Series& series, double h) : s_(s), series_(series), h_(h) {
    for (int i = 0; i < s.legs(); i++) {
      for (int d = 0; d < DIRECTIONS; d++) {
        const Leg& leg = s.body.legs[i];
        const double natural = std::sqrt(leg.stiffness[d] / leg.mass);
        if (leg.damping[d] < 2.0 * leg.mass * natural) turning_ = std::max(turning_, natural);
      }
    }
    turning_ += s.whole->state(s.state).system.sway;
    for (int i = 0; i < s.legs(); i++) {
      const Row& film = s.rows[i].film;
      const bool filmed = !s.feet[i].held(UP) && s.feet[i].filmed();
      thin_[i] = filmed && !(s.nodes.truncation(film) <= UNSEEN * highest(magnitude(film - film[N - 1])));
    }
  }

  // Add the energies from the start of the step to scaled time ``fraction``.
  void add(double fraction) {
    const double fast = s_.whole->state(s_.state).system.rate * h_;
    double end = std::min(fraction, 1.0);
    for (int n = 0; n < 60 && fast * end > 1.0; n++) {
      split(0.5 * end, end);
      end *= 0.5;
    }
    split(0.0, end);
  }

 private:
  Whole& s_;
  Series& series_;
  const double h_;
  double turning_ = 0.0;
  bool thin_[FEW_LEGS];  // the nodes do not see how the film changes over the step

  void split(double low, double high) {
    const int pieces = std::max(1, int(std::ceil(turning_ * h_ * (high - low) / PIECE)));
    for (int n = 0; n < pieces; n++) add_piece(low + (high - low) * n / pieces, low + (high - low) * (n + 1) / pieces);
  }

  void add_piece(double low, double high) {
    Row rates[FEW_LEGS], films[FEW_LEGS];
    for (int j = 0; j < N; j++) {
      const double at = low + (high - low) * s_.nodes.tau[j], weight = s_.between.weights[j] * (high - low) * h_;
      Row state[WHOLE_ROWS];
      series_.state_at(at, state);
      const double* y = reinterpret_cast<const double*>(state);
      add_moment(y, at, weight);
      for (int i = 0; i < s_.legs(); i++) {
        if (!thin_[i]) continue;
        rates[i].set(j, y[s_.layout.w(i, UP)]);
        films[i].set(j, s_.film(i, y[s_.layout.u(i, UP)] + s_.body.legs[i].gap));
      }
    }
    for (int i = 0; i < s_.legs(); i++) {
      if (!thin_[i]) continue;
      const double mass = s_.body.legs[i].mass, low = films[i][0], high = films[i][N - 1];
      s_.energy.film -= film_by_parts(s_.between, rates[i], films[i], mass, low, high);
    }
  }

  double drive(int c, double at) const { return s_.level[c] ? s_.channels[c][0] : s_.polynomial_at(s_.channels[c], at); }

  void add_moment(const double* y, double at, double weight) {
    Energies& energy = s_.energy;
    const WholeLayout& of = s_.layout;
    for (int b = 0; b < of.coordinates; b++) {
      double push = -s_.body.weight[b];
      for (int d = 0; d < of.drives; d++) {
        const double by = s_.body.load[d * of.coordinates + b];
        if (by != 0.0) push += by * drive(d, at);
      }
      energy.work += weight * push * y[of.v(b)];
    }
    for (int i = 0; i < of.legs; i++) {
      for (int d = 0; d < DIRECTIONS; d++) add_leg(i, d, y, at, weight);
    }
  }

  void add_leg(int i, int d, const double* y, double at, double weight) {
    Energies& energy = s_.energy;
    const WholeLayout& of = s_.layout;
    const Leg& leg = s_.body.legs[i];
    const LeggedFoot& foot = s_.feet[i];
    const LegRows& r = s_.rows[i];
    const bool filmed = d == UP && foot.filmed();
    double rate = foot.held(d) ? 0.0 : y[of.w(i, d)];
    if (filmed) rate += s_.polynomial_at(r.film, at) / leg.mass;
    const double across = leg.hip[d].motion(y + of.v(0)) - rate;
    energy.damping += weight * leg.damping[d] * across * across;
    if (foot.held(d)) return;
    double load = d == UP ? -leg.weight : 0.0;
    for (int n = leg.first; n < leg.last; n++) load += s_.body.gain[2 * n + d] * drive(s_.body.drive[n], at);
    energy.work += weight * load * rate;
    if (filmed && !thin_[i]) energy.film -= weight * rate * slope_of(r.film, at);
    if (d == UP && s_.acts[of.slot(i, 1)]) energy.smooth += weight * rate * s_.polynomial_at(r.smooth, at);
    if (d == ALONG && foot.contact == SLIPPING) energy.friction += weight * rate * foot.sense * s_.polynomial_at(r.bound, at);
    if (d == UP && foot.contact == AIR && leg.foot >= 0 && !s_.shares.empty()) add_shares(i, rate, at, weight);
  }

  // The same law by law; see ActingLaws::shares.
  void add_shares(int i, double rate, double at, double weight) {
    const Leg& leg = s_.body.legs[i];
    const LegRows& r = s_.rows[i];
    const auto &resistive = s_.laws.laws.terms[MOMENTUM], &smooth = s_.laws.laws.terms[FORCE];
    size_t share = 0;
    for (size_t n = 0; n + 1 < resistive.size(); n++) {
      s_.shares[share++] += weight * rate * slope_of(s_.laws.momentum_of(resistive[n], leg.foot, r.gap), at);
    }
    const Row now = s_.nodes.times() * h_ + s_.clock.time;
    for (size_t n = 0; n + 1 < smooth.size(); n++) {
      const Row force = s_.laws.force_of(smooth[n], leg.foot, r.gap, r.rate, s_.volts(leg.foot), now);
      s_.shares[share++] += weight * rate * s_.polynomial_at(force, at);
    }
  }

  // Rate of change [1/s] of what has given values at the nodes.
  double slope_of(const Row& values, double at) const {
    double line[N];
    store(line, s_.powers(values));
    return horner_slope(line, 0, N, at) / h_;
  }
};

}  // namespace tarsus::legged
