// Whether a foot may have an event inside a step: touchdown of a free one, detachment of a held one, slip and stick.
//
// Each foot has a margin that is positive until its event: the gap of a free foot; of a held one the strength of its
// contact less the structure's pull and its own smooth force. A foot that has just left the ground starts at zero. Along the
// ground a foot that slides has its rate in the direction of sliding; one that sticks has two, the largest friction force less the
// pull forward and backward. Margins lie kind by kind (see Modal::events), those of the ground first.
#pragma once
#include "modal/friction.hpp"

namespace tarsus::modal {

// Bound below which an event's margin counts as zero.
inline double no_event(const Modal& m, int event) {
  const int feet = m.sizes.feet, foot = event % feet;
  if (event < feet) return no_margin(m, foot);
  if (!m.mode->is_stuck[foot]) return no_slide(m, foot);
  const double steepest = size_of((m.margin[feet + foot] + m.margin[2 * feet + foot]) * 0.5);  // what friction bears, at most
  // of one that stays where it is at its very bound, see `stick_or_turn`, the first step
  const double at_bound = m.feet[foot].slide == FROM_REST ? CLOSE * steepest : 0.0;
  return no_margin(m, foot) + ROUNDING * (m.force_parts(feet + foot) + steepest) + at_bound;
}

// Whether an event's margin is what a contact bears beyond the force on it, along its normal or along the ground: such a force jumps
// with a drive, with the rates that an impact changes, and where another contact ends.
inline bool bears(const Modal& m, int event) {
  const int feet = m.sizes.feet;
  return event < feet ? bool(m.mode->is_held[event]) : bool(m.mode->is_stuck[event % feet]);
}

// Whether what pulls on a contact has jumped, so that its margin is below zero as the step begins: not on a foot that
// was released at this very moment and came back at once.
TARSUS_APART inline bool has_jumped(const Modal& m, int event, double margin, UnresolvedRoot& root) {
  if (!bears(m, event) || (event < m.sizes.feet && m.just_released(event))) return false;
  root.zero = no_event(m, event);
  if (!(margin < -root.zero)) return false;
  root.first = root.last = 1;
  return true;
}

// Node intervals in which an event may lie before the scaled time ``limit``; bound: of its margin's deviation from the chord
// of two nodes; departure: how the foot begins the step. Returns whether there is any.
inline bool find_unresolved(const Modal& m, int event, const double* margin, double bound, double limit, int departure, UnresolvedRoot& root) {
  const double* tau = m.nodes.tau;
  root = UnresolvedRoot();
  if (departure == UNDER_WAY && lowest(load(margin)) > bound) return false;
  if (margin[0] < 0.0 && has_jumped(m, event, margin[0], root)) return true;
  for (int j = 1; j < N && tau[j - 1] < limit; j++) {
    const double local = bound * m.chord[j];
    if (margin[j] < 0.0 && root.zero == 0.0) root.zero = no_event(m, event);
    const bool crossing = margin[j] < -root.zero;
    bool unsure;
    if (j == 1 && departure > UNDER_WAY) {
      // it starts at zero and rises: the chord must beat the steepest parabola of that bound
      unsure = margin[1] <= (departure == RISING ? 4.0 : 8.0) * local;
    } else {
      // a parabola of that bound b below a chord that rises by r dips (4 b - r)^2 / 16 b below its lower end
      const double low = 4.0 * local - std::fabs(margin[j] - margin[j - 1]);
      unsure = low > 0.0 && std::min(margin[j - 1], margin[j]) * 16.0 * local <= low * low;
    }
    if (crossing || unsure) {
      if (root.last == 0) root.first = j;
      root.last = j;
    }
    if (crossing) break;
  }
  return root.last > 0;
}

// Part of a new highest gap that the nodes may miss: a highest gap is reported, and decides nothing.
constexpr double MISSED_PEAK = 1e-4;

// How far a function through nodal values lies off its chord in the widest interval between nodes that begin before the scaled time
// ``limit``, by its second derivative.
TARSUS_APART inline double bulge_of(const Nodes& nodes, Row values, double limit) {
  Row second = nodes.slope(nodes.slope(values));
  for (int j = 2; j < N; j++) {
    if (nodes.tau[j - 1] >= limit) second.set(j, 0.0);
  }
  return 0.125 * nodes.spacing * nodes.spacing * size_of(second);
}

// How far what changing inputs add to an output at once, as a drive's force to the pull on a held foot, lies off its chords: the
// motion of the modes is bounded by itself. Less than ``enough`` is not determined any closer.
TARSUS_INLINE double bulge_of_inputs(const Modal& m, const StepClass& step, int output, double limit, double enough = 0.0) {
  const double *feed = m.mode->feed + output * m.sizes.inputs(), *rate = m.mode->feed_rate + output * m.sizes.inputs();
  Row sum = Row(0.0);
  double spread = 0.0;
  for (int i : m.inputs) {
    if (m.constant[i] || (feed[i] == 0.0 && rate[i] == 0.0)) continue;
    const Row part = rate[i] == 0.0 ? m.values[i] * feed[i]
                                    : m.values[i] * feed[i] + m.nodes.slope(m.values[i]) * (rate[i] / step.length);
    sum += part;
    spread += highest(part) - lowest(part);
  }
  // between its nodes a polynomial exceeds half its spread there about the middle by a factor below 2, its Lebesgue constant
  return 2.0 * spread <= enough ? 2.0 * spread : bulge_of(m.nodes, sum, limit);
}

// Whether the gap between the nodes could exceed theirs by more than that part of a new highest gap.
inline bool hides_peak(const Modal& m, int foot, double bound, double limit) {
  double top = 0.0;
  for (int j = 0; j < N && m.nodes.tau[j] <= limit; j++) top = std::max(top, m.outputs[foot][j]);
  return bound > MISSED_PEAK * top && top + bound > m.feet[foot].apex.gap;
}

struct Scan {
  bool unresolved = false;   // an event may be inside
  bool coarse = false;  // too coarse to see the top of a flight
  int interval = N;     // first doubtful node interval
  double far = 0.0;     // end of the last one, in scaled time
};

// Note the intervals in which an event may lie, by its margin and the bound of that between nodes.
inline void look(Modal& m, int event, double bound, double limit, int departure, Scan& out) {
  UnresolvedRoot& root = m.unresolved[event];
  if (!find_unresolved(m, event, reinterpret_cast<const double*>(&m.margin[event]), bound, limit, departure, root)) return;
  out.unresolved = true;
  out.interval = std::min(out.interval, root.first);
  out.far = std::max(out.far, m.nodes.tau[root.last]);
}

// The margins of a foot along the ground; of_margin, of_along: bounds, between nodes, of its
// margin and of its motion or force along the ground.
inline void look_along(Modal& m, const StepClass& step, int foot, double t, double of_margin, double of_along, double limit, Scan& out) {
  const int feet = m.sizes.feet, forward = feet + foot, backward = 2 * feet + foot;
  m.margin[forward] = m.margin[backward] = Row(0.0);
  m.unresolved[forward] = m.unresolved[backward] = UnresolvedRoot();
  const double sense = m.mode->is_held[foot] ? m.feet[foot].sense : 0.0;
  if (!m.mode->is_stuck[foot]) {
    if (sense == 0.0) return;
    m.margin[forward] = m.outputs[forward] * sense;
    return look(m, forward, of_along, limit, m.feet[foot].slide, out);
  }
  const Row strength = m.laws.strength(foot, m.nodes.times() * step.length + (t - m.feet[foot].since), m.volts[foot]);
  const SlidingBound bound = bound_by_law(m.laws, foot, m.margin[foot], strength, Row(0.0), Row(0.0));
  const double commanded = m.laws.commanded() ? size_of(bound.slope[HELD_STRENGTH]) * bulge_of(m.nodes, strength, limit) : 0.0;
  const double between = size_of(bound.slope[MARGIN]) * of_margin + commanded + of_along;
  m.margin[forward] = bound.value - m.outputs[forward];
  m.margin[backward] = bound.value + m.outputs[forward];
  for (int event : {forward, backward}) look(m, event, between, limit, UNDER_WAY, out);
}

template <class S>
TARSUS_APART Scan scan(Modal& m, const StepClass& step, double t, double limit) {
  Scan out;
  double* speeds = m.chain();  // made once for all feet
  for (int p = 0; p < S::packs(S::stride(m.sizes.stride)); p++) S::put(speeds + p * S::WIDTH, block_speeds<S>(m, p));
  for (int i = 0; i < m.sizes.feet; i++) {
    const bool held = m.mode->is_held[i];
    m.margin[i] = m.outputs[i];
    double own = 0.0;  // of what its volts and the drives do between nodes
    if (held) {
      const Row breaking = breaking_pull(m, i, t + m.nodes.times() * step.length, m.volts[i]);
      m.margin[i] = breaking - m.outputs[i];
      if (m.laws.commanded()) own = bulge_of(m.nodes, breaking, limit);
    }
    const auto bound_of = [&](int o) { return chord_bound<S>(m, step, o, [speeds](int p) { return S::get(speeds + p * S::WIDTH); }); };
    double bound = bound_of(i) + own;
    if (held) bound += bulge_of_inputs(m, step, i, limit, lowest(m.margin[i]) - bound);
    look(m, i, bound, limit, m.feet[i].departure, out);
    if (m.sizes.ways > 0) {
      const int along = m.sizes.feet + i;
      const double fed = m.mode->is_stuck[i] ? bulge_of_inputs(m, step, along, limit) : 0.0;
      look_along(m, step, i, t, bound, bound_of(along) + fed, limit, out);
    }
    if (m.settings.track && !held && hides_peak(m, i, bound, limit)) out.coarse = true;
  }
  return out;
}

}  // namespace tarsus::modal
