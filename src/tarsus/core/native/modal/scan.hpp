// Whether a foot may have an event inside a step: touchdown of a free one, break-off of a held one.
//
// Each foot has a margin that is positive while nothing happens: the gap of a free foot; of a held one the strength of its
// contact less the structure's pull and its own smooth force. A foot that has just left the ground starts at zero.
#pragma once
#include "modal/flow.hpp"

namespace tarsus::modal {

// Pull that breaks the contact of a foot off [N]: its strength less its smooth force at zero gap.
template <class Real>
inline Real breaking_pull(const Modal& m, int foot, const Real& t, const Real& volts) {
  Real holds = m.laws.strength(foot, t - m.feet[foot].since);
  if (m.laws.has(foot, HAS_FORCE)) holds -= m.laws.force(foot, Real(0.0), Real(0.0), volts, t);
  return holds;
}

// Below which a foot's margin is zero: by the scene's scales, or for all that rounding leaves of what adds up to it.
inline double no_margin(const Modal& m, int foot) {
  if (!m.mode->is_held[foot]) return m.no_gap(foot);
  double parts = m.gap_parts(foot) + std::fabs(m.laws.strength(foot, m.clock.time - m.feet[foot].since));
  for (int i : m.acting) parts += std::fabs(m.mode->feed[foot * m.sizes.inputs() + i] * m.value(i)[0]);
  return m.settings.force_zero + ROUNDING * parts;
}

// Node intervals in which a foot may have its event before the scaled time ``limit``; bound: what its margin may do
// between two nodes beyond their chord. Returns whether there is any.
inline bool find_doubt(const Modal& m, int foot, const double* margin, double bound, double limit, Doubt& doubt) {
  const double* tau = m.nodes.tau;
  const int departure = m.feet[foot].departure;
  doubt = Doubt();
  if (departure == UNDER_WAY && lowest(load(margin)) > bound) return false;
  for (int j = 1; j < N && tau[j - 1] < limit; j++) {
    const double local = bound * m.chord[j];
    if (margin[j] < 0.0 && doubt.zero == 0.0) doubt.zero = no_margin(m, foot);
    const bool crossing = margin[j] < -doubt.zero;
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
      if (doubt.last == 0) doubt.first = j;
      doubt.last = j;
    }
    if (crossing) break;
  }
  return doubt.last > 0;
}

// True where what lies between the nodes could hide more than 1e-4 of a new highest gap.
inline bool hides_peak(const Modal& m, int foot, double bound, double limit) {
  double top = 0.0;
  for (int j = 0; j < N && m.nodes.tau[j] <= limit; j++) top = std::max(top, m.outputs[foot][j]);
  return bound > 1e-4 * top && top + bound > m.feet[foot].apex.gap;
}

struct Scan {
  bool doubt = false;   // an event may be inside
  bool coarse = false;  // too coarse to see the top of a flight
  int interval = N;     // first doubtful node interval
  double far = 0.0;     // end of the last one, in scaled time
};

template <class S>
TARSUS_APART Scan scan(Modal& m, const StepClass& step, double t, double limit) {
  Scan out;
  double* speeds = m.chain();  // made once for all feet
  for (int p = 0; p < S::packs(S::stride(m.sizes.stride)); p++) S::put(speeds + p * S::WIDTH, block_speeds<S>(m, p));
  for (int i = 0; i < m.sizes.feet; i++) {
    const bool held = m.mode->is_held[i];
    m.margin[i] = m.outputs[i];
    if (held) m.margin[i] = breaking_pull(m, i, t + m.nodes.times() * step.length, m.volts[i]) - m.outputs[i];
    const double bound = chord_bound<S>(m, step, i, [speeds](int p) { return S::get(speeds + p * S::WIDTH); });
    const double* margin = reinterpret_cast<const double*>(&m.margin[i]);
    Doubt& doubt = m.doubts[i];
    if (find_doubt(m, i, margin, bound, limit, doubt)) {
      out.doubt = true;
      out.interval = std::min(out.interval, doubt.first);
      out.far = std::max(out.far, m.nodes.tau[doubt.last]);
    }
    if (m.settings.track && !held && hides_peak(m, i, bound, limit)) out.coarse = true;
  }
  return out;
}

}  // namespace tarsus::modal
