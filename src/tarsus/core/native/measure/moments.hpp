// Mean and spread of values, and what is said of several feet.
#pragma once
#include "measure/windows.hpp"

namespace tarsus::measure {

// n: how many values there were; spread: their standard deviation, NaN of fewer than two.
struct Summary {
  double value = NONE, spread = NONE;
  int64_t n = 0;
};

// Of those values that are finite.
inline Summary moments(const double* values, size_t count) {
  Summary out;
  double sum = 0.0, squares = 0.0;
  for (size_t k = 0; k < count; k++) {
    if (!std::isfinite(values[k])) continue;
    sum += values[k];
    out.n++;
  }
  if (out.n == 0) return out;
  out.value = sum / double(out.n);
  for (size_t k = 0; k < count; k++) {
    if (std::isfinite(values[k])) squares += (values[k] - out.value) * (values[k] - out.value);
  }
  if (out.n > 1) out.spread = std::sqrt(squares / double(out.n - 1));
  return out;
}

// Of a robot's values by period: known where all of them are.
inline Summary of_robot(const Values& values) {
  const Summary out = moments(values.data(), values.size());
  return out.n == int64_t(values.size()) ? out : Summary();
}

// Of several feet that have values: the one with the largest mean, or their mean, the largest of their spreads and the fewest values.
inline Summary of_feet(const std::vector<Summary>& feet, bool worst) {
  Summary out;
  const Summary* highest = nullptr;
  double total = 0.0;
  int64_t met = 0;
  for (const Summary& one : feet) {
    if (one.n == 0) continue;
    met++;
    total += one.value;
    if (highest == nullptr || one.value > highest->value) highest = &one;
    if (std::isfinite(one.spread) && !(one.spread <= out.spread)) out.spread = one.spread;
  }
  if (met == 0) return out;
  if (worst) return *highest;
  out.value = total / double(met);
  out.n = feet[0].n;
  for (const Summary& one : feet) out.n = std::min(out.n, one.n);
  return out;
}

}  // namespace tarsus::measure
