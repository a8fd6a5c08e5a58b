// Highest gap of a flight, and the integral of the gap.
#pragma once
#include "march/log.hpp"
#include "base/nodes.hpp"

namespace tarsus {

constexpr double INVERSE[N + 1] = {0.0, 1.0, 1.0 / 2.0, 1.0 / 3.0, 1.0 / 4.0, 1.0 / 5.0, 1.0 / 6.0, 1.0 / 7.0, 1.0 / 8.0};

// Where a polynomial of the scaled time has its peak, between ``low``, where it rises, and ``high``, where it falls: a zero of its
// slope by Newton's method, kept between the two. A height errs by the square of what the time errs by.
inline double peak_time(const double* line, double low, double high) {
  constexpr double SAME_TIME = 1e-10;  // of a step: what it errs by in height is rounding
  constexpr int MOST = 60;             // halvings of a step leave nothing of it
  double s = 0.5 * (low + high);
  for (int n = 0; n < MOST; n++) {
    double slope = (N - 1) * line[N - 1], bend = 0.0;
    for (int c = N - 2; c >= 1; c--) {
      bend = bend * s + slope;
      slope = slope * s + c * line[c];
    }
    (slope > 0.0 ? low : high) = s;
    double next = s - slope / bend;
    if (!(low < next && next < high)) next = 0.5 * (low + high);
    if (std::fabs(next - s) <= SAME_TIME) return next;
    s = next;
  }
  return s;
}

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
      s = peak_time(line, low, high);
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

// Lowest (sense -1) or highest (sense 1) value of the polynomial through nodal values up to scaled time ``limit``.
inline double extreme(const Nodes& nodes, const Row& values, double sense, double limit) {
  int best = 0;
  for (int j = 1; j < N && nodes.tau[j] <= limit; j++) {
    if (sense * values[j] > sense * values[best]) best = j;
  }
  double low = best > 0 ? nodes.tau[best - 1] : 0.0, high = std::min(best < N - 1 ? nodes.tau[best + 1] : 1.0, limit);
  double line[N];
  store(line, powers_of(nodes, reinterpret_cast<const double*>(&values)) * sense);
  const auto rising = [&](double s) { return horner_slope(line, 0, N, s) > 0.0; };
  if (!(low < high && rising(low) && !rising(high))) return values[best];
  return sense * horner(line, 0, N, peak_time(line, low, high));
}

}  // namespace tarsus
