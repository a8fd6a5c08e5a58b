// Highest and lowest places between the nodes of a step as long as a leg's turn: by values and rates together.
#pragma once
#include "legged/legged.hpp"

namespace tarsus::legged {

// The polynomial p + omega r of degree 15 that has given values and rates (by the scaled time) at the nodes; omega is 0 at all of
// them. Over 5 rad of an oscillation it is off by 2e-12 of it, where that through the values alone is off by 2e-4.
class Hermite {
 public:
  Hermite(const Legged& s, const Row& values, const Row& rates) : nodes_(s.nodes) {
    store(p_, s.powers(values));
    Row turn = Row(1.0);
    for (int k = 0; k < N; k++) {
      Row apart = nodes_.times() - nodes_.tau[k];
      apart.set(k, 1.0);
      turn *= apart;
    }
    store(r_, s.powers((rates - combine(&s.between.slope[0][0], values)) / turn));
  }
  double value(double s) const { return horner(p_, 0, N, s) + omega(s) * horner(r_, 0, N, s); }
  double slope(double s) const {
    double product = 1.0, turns = 0.0;
    for (int k = 0; k < N; k++) {
      turns = turns * (s - nodes_.tau[k]) + product;
      product *= s - nodes_.tau[k];
    }
    return horner_slope(p_, 0, N, s) + turns * horner(r_, 0, N, s) + product * horner_slope(r_, 0, N, s);
  }
  // Integral from 0 to s.
  double integral(const Legged& of, double s) const {
    double sum = 0.0;
    for (int j = 0; j < N; j++) sum += of.between.weights[j] * value(s * nodes_.tau[j]);
    return sum * s;
  }

 private:
  const Nodes& nodes_;
  double p_[N], r_[N];

  double omega(double s) const {
    double product = 1.0;
    for (int k = 0; k < N; k++) product *= s - nodes_.tau[k];
    return product;
  }
};

struct Peak {
  double value, at;  // at: scaled time
};

// The largest of ``sense`` times a motion up to scaled time ``limit``, where that may exceed ``known``; rates by the scaled time.
inline Peak peak_of(const Legged& s, const Row& values, const Row& rates, double sense, double limit, double known) {
  const double* tau = s.nodes.tau;
  int best = 0;
  for (int j = 1; j < N && tau[j] <= limit; j++) {
    if (sense * values[j] > sense * values[best]) best = j;
  }
  const bool on = sense * rates[best] > 0.0;
  const double low = on || best == 0 ? tau[best] : tau[best - 1];
  const double high = std::min(on && best < N - 1 ? tau[best + 1] : on ? 1.0 : tau[best], limit);
  Peak out = {sense * values[best], tau[best]};
  if (!(high > low) || out.value + std::fabs(rates[best]) * (high - low) <= known) return out;
  const Hermite motion(s, values, rates);
  double from = low, to = high, at = high;
  if (sense * motion.slope(high) < 0.0) {
    double above = sense * motion.slope(low), below = sense * motion.slope(high);
    if (!(above > 0.0)) return out;
    const auto chord = [&] { return from + (to - from) * above / (above - below); };
    for (int n = 0; n < 12 && to - from > 1e-9; n++) {  // halving every third time
      const double tried = n % 3 == 2 ? 0.5 * (from + to) : chord(), slope = sense * motion.slope(tried);
      (slope > 0.0 ? from : to) = tried;
      (slope > 0.0 ? above : below) = slope;
    }
    at = chord();
  }
  const double value = sense * motion.value(at);
  return value > out.value ? Peak{value, at} : out;
}

}  // namespace tarsus::legged
