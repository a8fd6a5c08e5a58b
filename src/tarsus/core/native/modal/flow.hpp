// Exact linear flow over a step: outputs at its nodes and the state at its end. No physics.
#pragma once
#include "modal/state.hpp"

namespace tarsus::modal {

// The part of an output at the nodes of a step that state and drives make.
template <class S>
TARSUS_INLINE Row flowing_output(const Modal& m, const StepClass& step, int output) {
  const int ns = S::stride(m.sizes.stride), nb = S::COUNT * S::WIDTH == 2 ? 2 : m.mode->blocks_used;
  const double *x = m.state(), *y = x + ns, *table = step.from_state(output);
  Row even = load(m.bias_step->node + output * N), odd = Row(0.0);
  for (int b = 0; b < nb; b++) {
    even += load(table + 2 * N * b) * x[b];
    odd += load(table + 2 * N * b + N) * y[b];
  }
  for (int d = 0; d < m.sizes.drives; d++) {
    const int i = 2 * m.sizes.feet + d;
    if (m.constant[i]) {
      even += step.from_constant(output, i) * m.value(i)[0];
    } else {
      odd += combine(step.from_input(output, i), m.values[i]);
    }
  }
  if (__builtin_expect(m.sizes.ways > 0, 0)) {
    for (int k : m.mode->stuck) even += step.from_constant(output, m.sizes.feet + k) * m.feet[k].place;
  }
  return even + odd;
}

// The blocks of packs p of a state (x, y), times a matrix of (4, stride).
template <class S>
TARSUS_INLINE void turn(const double* matrix, int stride, int p, const typename S::Pack& x, const typename S::Pack& y,
                        typename S::Pack& u, typename S::Pack& v) {
  const double* at = matrix + p * S::WIDTH;
  u = S::get(at) * x + S::get(at + stride) * y;
  v = S::get(at + 2 * stride) * x + S::get(at + 3 * stride) * y;
}

// State at the end of the whole step: exp(T h) w and what the inputs add. Returns whether all of it is finite.
template <class S>
TARSUS_INLINE bool flow(Modal& m, const StepClass& step) {
  const int ns = S::stride(m.sizes.stride), size = 2 * ns;
  const double* w = m.state();
  typename S::Pack zero = {};
  for (int p = 0; p < S::packs(ns); p++) {
    typename S::Pack x, y;
    turn<S>(step.exponential, ns, p, S::get(w + p * S::WIDTH), S::get(w + ns + p * S::WIDTH), x, y);
    x += S::get(m.bias_step->state + p * S::WIDTH);
    y += S::get(m.bias_step->state + ns + p * S::WIDTH);
    for (int i : m.inputs) {
      const double *values = m.value(i), *steady = step.state_constant + i * size + p * S::WIDTH;
      if (m.constant[i]) {
        x += S::get(steady) * values[0];
        y += S::get(steady + ns) * values[0];
        continue;
      }
      const double* table = step.state_input + i * N * size + p * S::WIDTH;
      for (int j = 0; j < N; j++) {
        x += S::get(table + j * size) * values[j];
        y += S::get(table + j * size + ns) * values[j];
      }
    }
    S::put(m.ahead() + p * S::WIDTH, x);
    S::put(m.ahead() + ns + p * S::WIDTH, y);
    zero += (x + y) * 0.0;
  }
  return S::sum(zero) == 0.0;
}

// What an output may do between two nodes beyond their chord: the envelope times a bound of |y'| of every block, its start
// value and what changing inputs add. Here that of the blocks of pack p.
template <class S>
TARSUS_INLINE typename S::Pack block_speeds(const Modal& m, int p) {
  const ContactMode& mode = *m.mode;
  const int ns = S::stride(m.sizes.stride), size = 2 * ns, at = p * S::WIDTH;
  const double* w = m.state();
  typename S::Pack x, y, change = {};
  turn<S>(mode.blocks, ns, p, S::get(w + at), S::get(w + ns + at), x, y);
  x += S::get(m.bias->inputs + at);
  y += S::get(m.bias->inputs + ns + at);
  for (int i : m.inputs) {
    const double value = m.value(i)[0];
    x += S::get(mode.inputs + i * size + at) * value;
    y += S::get(mode.inputs + i * size + ns + at) * value;
    if (!m.constant[i]) change += S::get(mode.input_norm + i * ns + at) * (highest(m.values[i]) - lowest(m.values[i]));
  }
  return S::length(x, y) + change;
}

// The bound of an output by the speeds of the blocks in pack p.
template <class S, class Speeds>
TARSUS_INLINE double chord_bound(const Modal& m, const StepClass& step, int output, const Speeds& speeds) {
  const int ns = S::stride(m.sizes.stride);
  const double* envelope = step.envelope + output * ns;
  typename S::Pack sum = {};
  for (int p = 0; p < S::packs(ns); p++) sum += S::get(envelope + p * S::WIDTH) * speeds(p);
  return S::sum(sum);
}

}  // namespace tarsus::modal
