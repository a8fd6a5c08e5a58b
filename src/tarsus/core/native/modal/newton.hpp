// Smooth forces at the nodes of a step, and Newton's method for the gaps they leave where a film is too stiff for sweeps.
#pragma once
#include "base/dense.hpp"
#include "modal/state.hpp"

namespace tarsus::modal {

constexpr int ITERATIONS = 40, HALVINGS = 12;  // Newton steps at most, and how often each may be halved
// Share of the tolerance of a gap below which sweeps and Newton steps change it once they have converged: the rest of the
// tolerance is for the truncation of the step.
constexpr double CONVERGED_SHARE = 0.05;

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

// Collect the smooth inputs of all feet in those of the leading feet, where the other feet's gaps are sums of the leading
// ones': the structure moves as under all of them.
inline void collect_inputs(Modal& m) {
  if (!m.mode->shares()) return;
  const int feet = m.sizes.feet, lead = int(m.mode->leading.size());
  for (int i : m.pushing) m.collected[i] = Row(0.0);
  for (int i : m.acting) {
    if (i >= 2 * feet) break;
    const double* share = m.mode->spanned + i % feet * lead;
    for (int l = 0; l < lead; l++) m.collected[m.mode->leading[l] + (i < feet ? 0 : feet)] += m.values[i] * share[l];
  }
}

// Effect of the smooth forces on the pull of a held foot, which carries the parts of them that move nothing, too.
inline Row effect_on_held(const Modal& m, const StepClass& step, int output) {
  Row sum = Row(0.0);
  for (int i : m.acting) {
    if (i >= 2 * m.sizes.feet) break;
    sum += combine(step.from_input(output, i), m.values[i]);
  }
  return sum;
}

// Effect of the smooth forces, once collected, on an output of a free foot at the nodes.
inline Row smooth_effect(const Modal& m, const StepClass& step, int output) {
  const std::vector<Row>& values = m.mode->shares() ? m.collected : m.values;
  Row sum = Row(0.0);
  for (int i : m.pushing) sum += combine(step.from_input(output, i), values[i]);
  return sum;
}

// Find outputs of the other feet from those of the leading ones: gaps, or (first = feet) gap rates.
inline void follow_leading(Modal& m, int first) {
  const ContactMode& mode = *m.mode;
  if (!mode.shares()) return;
  const int lead = int(mode.leading.size());
  for (int l = 0; l < lead; l++) m.moved[l] = m.outputs[first + mode.leading[l]] - m.linear[first + mode.leading[l]];
  for (int i : mode.free) {
    if (std::binary_search(mode.leading.begin(), mode.leading.end(), i)) continue;
    Row sum = m.linear[first + i];
    for (int l = 0; l < lead; l++) sum += m.moved[l] * mode.spanned[i * lead + l];
    m.outputs[first + i] = sum;
  }
}

// Outputs of the free feet with the smooth forces as they are. Returns the largest change of a leading foot's nodal gap [m],
// or NaN.
inline double sweep(Modal& m, const StepClass& step) {
  const int feet = m.sizes.feet;
  double change = 0.0;
  bool fine = true;
  collect_inputs(m);
  for (int i : m.mode->leading) {
    const Row gap = m.linear[i] + smooth_effect(m, step, i), moved = magnitude(gap - m.outputs[i]);
    change = std::max(change, highest(moved));
    fine = fine && finite(moved);
    m.outputs[i] = gap;
    if (m.rated) m.outputs[feet + i] = m.linear[feet + i] + smooth_effect(m, step, feet + i);
  }
  follow_leading(m, 0);
  if (m.rated) follow_leading(m, feet);
  return fine ? change : NOT_A_NUMBER;
}

// Largest misfit [m] of the leading feet's nodal gaps, which stay as they are.
inline double misfit_of(Modal& m, const StepClass& step) {
  double misfit = 0.0;
  collect_inputs(m);
  for (int i : m.mode->leading) {
    misfit = std::max(misfit, highest(magnitude(m.linear[i] - m.outputs[i] + smooth_effect(m, step, i))));
  }
  return misfit;
}

// Slope by its gap of a smooth input of a foot.
inline Row input_slope(const Modal& m, int input, double t, double h) {
  const int feet = m.sizes.feet, f = input % feet;
  const double probe = m.settings.probe;
  if (input < feet) return m.laws.momentum_slope(f, m.outputs[f], probe);
  const Row &rate = m.outputs[input], time = t + m.nodes.times() * h;
  Row slope = m.laws.force(f, m.outputs[f] + Row(probe), rate, m.volts[f], time);
  slope -= m.laws.force(f, m.outputs[f] - Row(probe), rate, m.volts[f], time);
  return slope / (2.0 * probe);
}

// Subtract from the matrix the effect of an input on all leading feet, per unit of the gap of leading foot number ``by``, with
// which the input changes by ``slope``.
inline void subtract_slope(Modal& m, const StepClass& step, int width, int input, int by, const Row& slope) {
  const std::vector<int>& leading = m.mode->leading;
  for (int o = 0; o < int(leading.size()); o++) {
    const double* effect = step.from_input(leading[o], input);
    for (int b = 0; b < N; b++) {
      for (int j = 0; j < N; j++) m.matrix[(o * N + j) * width + by * N + b] -= effect[b * N + j] * slope[b];
    }
  }
}

// I - d(effect of the smooth forces) / d(nodal gaps) of the leading feet; rows and columns: number of the foot among them
// times N plus node. A foot that follows by shares adds share x slope x share between them.
inline void assemble(Modal& m, const StepClass& step, double t, int width) {
  const ContactMode& mode = *m.mode;
  const int feet = m.sizes.feet, lead = int(mode.leading.size()), size = lead * N;
  for (int r = 0; r < size; r++) {
    for (int c = 0; c < size; c++) m.matrix[r * width + c] = r == c ? 1.0 : 0.0;
  }
  if (!mode.shares()) {
    for (int l = 0; l < lead; l++) {
      for (int i : {mode.leading[l], feet + mode.leading[l]}) {
        if (m.laws.has(mode.leading[l], i < feet ? HAS_MOMENTUM : HAS_FORCE)) {
          subtract_slope(m, step, width, i, l, input_slope(m, i, t, step.length));
        }
      }
    }
    return;
  }
  for (int first : {0, feet}) {
    m.slopes.assign(size_t(lead) * lead, Row(0.0));
    bool any = false;
    for (int i : m.acting) {
      if (i >= 2 * feet || (i < feet) != (first == 0)) continue;
      any = true;
      const Row slope = input_slope(m, i, t, step.length);
      const double* share = mode.spanned + i % feet * lead;
      for (int l = 0; l < lead; l++) {
        for (int c = 0; c < lead && share[l] != 0.0; c++) m.slopes[l * lead + c] += slope * (share[l] * share[c]);
      }
    }
    for (int l = 0; any && l < lead; l++) {
      for (int c = 0; c < lead; c++) subtract_slope(m, step, width, first + mode.leading[l], c, m.slopes[l * lead + c]);
    }
  }
}

// Nodal gaps consistent with the smooth forces, by damped Newton steps from the gaps of the first node. False where it
// does not converge.
inline bool newton(Modal& m, const StepClass& step, double t) {
  const std::vector<int>& leading = m.mode->leading;
  const int size = int(leading.size()) * N, width = size + 2;  // the last column keeps where a step starts
  const double tolerance = CONVERGED_SHARE * m.settings.gap;
  m.matrix.resize(size_t(size) * width);
  bool converged = false;
  for (int i : m.mode->free) m.outputs[i] = Row(m.linear[i][0]);
  for (int n = 0; n < ITERATIONS; n++) {
    evaluate_laws(m, t, step.length);
    assemble(m, step, t, width);
    for (int r = 0; r < size; r++) m.matrix[r * width + size + 1] = m.outputs[leading[r / N]][r % N];
    const double misfit = sweep(m, step);
    if (!std::isfinite(misfit)) return false;
    for (int r = 0; r < size; r++) {
      m.matrix[r * width + size] = m.outputs[leading[r / N]][r % N] - m.matrix[r * width + size + 1];
    }
    if (!eliminate(m.matrix.data(), size, width)) return false;
    double change = 0.0, sum = 0.0;
    for (int r = 0; r < size; r++) {
      change = std::max(change, std::fabs(m.matrix[r * width + size]));
      sum += m.matrix[r * width + size];
    }
    if (!std::isfinite(change) || !std::isfinite(sum)) return false;
    double damp = 1.0;
    for (int d = 0; d < HALVINGS; d++, damp *= 0.5) {
      for (int r = 0; r < size; r++) {
        m.outputs[leading[r / N]].set(r % N, m.matrix[r * width + size + 1] + damp * m.matrix[r * width + size]);
      }
      follow_leading(m, 0);
      evaluate_laws(m, t, step.length);
      if (change * damp <= tolerance || misfit_of(m, step) < misfit) break;
    }
    // the momenta of a strong film magnify the remaining error of its gaps: one more step, which squares that error
    if (change * damp <= tolerance && (converged || !m.strong)) {
      collect_inputs(m);
      return true;
    }
    converged = change * damp <= tolerance;
  }
  return false;
}

}  // namespace tarsus::modal
