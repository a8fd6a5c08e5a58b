// Highest gap of a flight, and the integral of the gap.
#pragma once
#include "march/log.hpp"
#include "base/nodes.hpp"

namespace tarsus {

constexpr double INVERSE[N + 1] = {0.0, 1.0, 1.0 / 2.0, 1.0 / 3.0, 1.0 / 4.0, 1.0 / 5.0, 1.0 / 6.0, 1.0 / 7.0, 1.0 / 8.0};

// Keep the highest gap [m] of a flight, its time and the gap's integral [m s], up to scaled time ``limit`` of the step
// [t, t + h]. Between the nodes the gap is the polynomial through them; its slope is searched on the two intervals next
// to the highest node.
inline void raise_apex(const Nodes& nodes, Apex& apex, const double* gap, double limit, double t, double h) {
  int best = 0;
  for (int j = 1; j < N && nodes.tau[j] <= limit; j++) {
    if (gap[j] > gap[best]) best = j;
  }
  double low = best > 0 ? nodes.tau[best - 1] : 0.0;
  double high = std::min(best < N - 1 ? nodes.tau[best + 1] : 1.0, limit);
  double top = gap[best], s = nodes.tau[best];
  double line[N];
  powers_of(nodes, gap, line);
  double sum = line[N - 1] * INVERSE[N];
  for (int c = N - 2; c >= 0; c--) sum = sum * limit + line[c] * INVERSE[c + 1];
  apex.integral += sum * limit * h;
  // a flight that begins in this step has no height yet, whatever the rounding of its first node
  if ((top > 0.5 * apex.gap || apex.gap == 0.0) && high > low) {
    const double last = horner_slope(line, 0, N, high);
    if (last < 0.0 && horner_slope(line, 0, N, low) > 0.0) {
      for (int n = 0; n < 30; n++) {
        s = 0.5 * (low + high);
        (horner_slope(line, 0, N, s) > 0.0 ? low : high) = s;
      }
    } else if (last >= 0.0) {
      s = high;
    }
    top = std::max(top, horner(line, 0, N, s));
  }
  if (top > apex.gap) {
    apex.gap = top;
    apex.time = t + s * h;
  }
}

// Lowest (sense -1) or highest (sense 1) value of the polynomial through nodal values up to scaled time ``limit``, and where.
struct Extreme {
  double value, at;
};

inline Extreme extreme(const Nodes& nodes, const Row& values, double sense, double limit) {
  int best = 0;
  for (int j = 1; j < N && nodes.tau[j] <= limit; j++) {
    if (sense * values[j] > sense * values[best]) best = j;
  }
  double low = best > 0 ? nodes.tau[best - 1] : 0.0, high = std::min(best < N - 1 ? nodes.tau[best + 1] : 1.0, limit);
  double line[N];
  store(line, powers_of(nodes, reinterpret_cast<const double*>(&values)));
  const auto rising = [&](double s) { return sense * horner_slope(line, 0, N, s) > 0.0; };
  if (!(low < high && rising(low) && !rising(high))) return {values[best], nodes.tau[best]};
  for (int n = 0; n < 40; n++) {
    const double middle = 0.5 * (low + high);
    (rising(middle) ? low : high) = middle;
  }
  return {horner(line, 0, N, low), low};
}

}  // namespace tarsus
