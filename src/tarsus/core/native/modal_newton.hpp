// Smooth forces at the nodes of a step, and Newton's method for the gaps they leave where a film is too stiff for sweeps.
#pragma once
#include "dense.hpp"
#include "modal_state.hpp"

namespace tarsus::modal {

constexpr int ITERATIONS = 40;

// Nodal momentum and force of every free foot from the nodal gaps and gap rates.
inline void evaluate_laws(Modal& m, double t, double h) {
  const int feet = m.sizes.feet;
  for (int i : m.acting) {
    if (i >= 2 * feet) return;
    if (i < feet) {
      m.values[i] = m.film(i, m.outputs[i]);
    } else {
      const int f = i - feet;
      m.values[i] = m.laws.force(f, m.outputs[f], m.outputs[i], m.volts[f], t + m.nodes.times() * h);
    }
  }
}

// What the smooth forces do to an output at the nodes.
inline Row smooth_effect(const Modal& m, const StepClass& step, int output) {
  Row sum = Row(0.0);
  for (int i : m.acting) {
    if (i >= 2 * m.sizes.feet) break;
    sum += combine(step.from_input(output, i), m.values[i]);
  }
  return sum;
}

// Outputs of the free feet with the smooth forces as they are. Returns the largest change of a nodal gap [m], or NaN.
inline double sweep(Modal& m, const StepClass& step) {
  double change = 0.0;
  bool fine = true;
  for (int i : m.mode->free) {
    const Row gap = m.linear[i] + smooth_effect(m, step, i), moved = magnitude(gap - m.outputs[i]);
    change = std::max(change, highest(moved));
    fine = fine && finite(moved);
    m.outputs[i] = gap;
    const int rate = m.sizes.feet + i;
    if (m.laws.has(i, USES_RATE)) m.outputs[rate] = m.linear[rate] + smooth_effect(m, step, rate);
  }
  return fine ? change : NOT_A_NUMBER;
}

// Largest misfit [m] of the nodal gaps, which stay as they are.
inline double misfit_of(const Modal& m, const StepClass& step) {
  double misfit = 0.0;
  for (int i : m.mode->free) misfit = std::max(misfit, highest(magnitude(m.linear[i] - m.outputs[i] + smooth_effect(m, step, i))));
  return misfit;
}

// I - d(effect of the smooth forces) / d(nodal gaps); rows and columns: number of the free foot times N plus node.
inline void assemble(Modal& m, const StepClass& step, double t, int width) {
  const std::vector<int>& free = m.mode->free;
  const int size = int(free.size()) * N;
  const double probe = m.settings.probe;
  for (int r = 0; r < size; r++) {
    for (int c = 0; c < size; c++) m.matrix[r * width + c] = r == c ? 1.0 : 0.0;
  }
  for (int i : m.acting) {
    if (i >= 2 * m.sizes.feet) break;
    const int f = i % m.sizes.feet, column = int(std::lower_bound(free.begin(), free.end(), f) - free.begin()) * N;
    Row slope;
    if (i < m.sizes.feet) {
      slope = m.laws.momentum_slope(f, m.outputs[f], probe);
    } else {
      const Row &rate = m.outputs[i], time = t + m.nodes.times() * step.length;
      slope = m.laws.force(f, m.outputs[f] + Row(probe), rate, m.volts[f], time);
      slope -= m.laws.force(f, m.outputs[f] - Row(probe), rate, m.volts[f], time);
      slope = slope / (2.0 * probe);
    }
    for (int o = 0; o < int(free.size()); o++) {
      const double* effect = step.from_input(free[o], i);
      for (int b = 0; b < N; b++) {
        for (int j = 0; j < N; j++) m.matrix[(o * N + j) * width + column + b] -= effect[b * N + j] * slope[b];
      }
    }
  }
}

// Nodal gaps consistent with the smooth forces, by damped Newton steps from the gaps of the first node. False where it
// does not converge.
inline bool newton(Modal& m, const StepClass& step, double t) {
  const std::vector<int>& free = m.mode->free;
  const int count = int(free.size()), size = count * N, width = size + 2;  // the last column keeps where a step starts
  const double tolerance = 0.05 * m.settings.gap;
  m.matrix.resize(size_t(size) * width);
  bool settled = false;
  for (int i : free) m.outputs[i] = Row(m.linear[i][0]);
  for (int n = 0; n < ITERATIONS; n++) {
    evaluate_laws(m, t, step.length);
    assemble(m, step, t, width);
    for (int r = 0; r < size; r++) m.matrix[r * width + size + 1] = m.outputs[free[r / N]][r % N];
    const double misfit = sweep(m, step);
    if (!std::isfinite(misfit)) return false;
    for (int r = 0; r < size; r++) {
      m.matrix[r * width + size] = m.outputs[free[r / N]][r % N] - m.matrix[r * width + size + 1];
    }
    if (!eliminate(m.matrix.data(), size, width)) return false;
    double change = 0.0, sum = 0.0;
    for (int r = 0; r < size; r++) {
      change = std::max(change, std::fabs(m.matrix[r * width + size]));
      sum += m.matrix[r * width + size];
    }
    if (!std::isfinite(change) || !std::isfinite(sum)) return false;
    double damp = 1.0;
    for (int d = 0; d < 12; d++, damp *= 0.5) {
      for (int r = 0; r < size; r++) {
        m.outputs[free[r / N]].set(r % N, m.matrix[r * width + size + 1] + damp * m.matrix[r * width + size]);
      }
      evaluate_laws(m, t, step.length);
      if (change * damp <= tolerance || misfit_of(m, step) < misfit) break;
    }
    // what a strong film's gaps leave open its momenta magnify: once more, which squares it
    if (change * damp <= tolerance && (settled || !m.strong)) return true;
    settled = change * damp <= tolerance;
  }
  return false;
}

}  // namespace tarsus::modal
