// One collocation step: the gaps at the nodes of a step, consistent with the smooth forces they cause.
#pragma once
#include "modal/friction.hpp"
#include "modal/newton.hpp"

namespace tarsus::modal {

constexpr int SWEEPS = 14;
constexpr double DEEP = 0.9;  // share of a foot's room to the ground (or the film's own singularity) that no step may use up
constexpr double DEEP_ENOUGH = 0.8;  // and that a step shortened for it may use up: less, for the gap by which it is shortened is an estimate
constexpr double NOT_CONVERGED = -1.0;  // error of a step whose smooth forces do not converge

// A film that changes the gap by more than this share of the change of the gap that causes it is too stiff for sweeps: each would
// leave more than half of the change of the one before.
constexpr double STIFFNESS = 0.5;
// From the fourth sweep on each must change less than this share of what the one before changed: a slower one would not converge
// within SWEEPS, and Newton's method or a shorter step takes less time.
constexpr double SLOWEST = 0.7;

// Whether a foot would come close to where its film is infinite: a film P ~ 1/(g + g0)^2 is -2 P/P' away from it. Then
// room[foot] = s - 1, with s the scaled time at which DEEP_ENOUGH of that way is used up.
inline bool runs_deep(Modal& m, int foot, const Row& gap) {
  double& room = m.room[foot];
  if (!(lowest(gap) < gap[0] - DEEP * room)) return false;
  const double level = gap[0] - DEEP_ENOUGH * room;
  int j = 1;
  while (j < N - 1 && gap[j] >= level) j++;
  const double* tau = m.nodes.tau;
  room = tau[j - 1] + (tau[j] - tau[j - 1]) * (gap[j - 1] - level) / (gap[j - 1] - gap[j]) - 1.0;
  return true;
}

// Sweeps for the smooth forces of the free feet from those of the first node, held constant; ``linear`` holds the outputs
// without them. CONVERGED; FAILED where the step is too long; STIFF where the film is too stiff for sweeps.
enum Convergence { CONVERGED, FAILED, STIFF };

inline Convergence start_sweeps(Modal& m, const StepClass& step, double t) {
  const ContactMode& mode = *m.mode;
  const int feet = m.sizes.feet;
  for (int i : mode.free) {
    m.room[i] = 0.0;
    m.outputs[i] = m.linear[i];
    m.outputs[feet + i] = m.linear[feet + i];
  }
  for (int i : mode.free) {
    const double gap = m.linear[i][0];
    if (m.laws.has(i, HAS_MOMENTUM)) {
      const double p = m.laws.momentum(i, gap), slope = m.laws.momentum_slope(i, gap, m.settings.probe);
      if (std::fabs(slope * step.from_constant(i, i)[N - 1]) > STIFFNESS) return STIFF;
      m.room[i] = slope < 0.0 ? 2.0 * p / -slope : 0.0;
      m.values[i] = Row(m.strong ? m.film(i, gap) : p);
    }
    if (m.laws.has(i, HAS_FORCE)) {
      m.values[feet + i] = Row(m.laws.force(i, gap, m.linear[feet + i][0], m.volts[i][0], t));
    }
  }
  collect_inputs(m);
  const std::vector<Row>& values = mode.shares() ? m.collected : m.values;
  for (int o : mode.leading) {
    for (int i : m.pushing) m.outputs[o] += step.from_constant(o, i) * values[i][0];
  }
  follow_leading(m, 0);
  for (int i : mode.free) {
    if (m.room[i] > 0.0 && runs_deep(m, i, m.outputs[i])) return FAILED;
  }
  return CONVERGED;
}

inline Convergence sweeps(Modal& m, const StepClass& step, double t) {
  const Convergence started = start_sweeps(m, step, t);
  if (started != CONVERGED) return started;
  const double tolerance = CONVERGED_SHARE * m.settings.gap;
  double before = INF;
  for (int n = 0; n < SWEEPS; n++) {
    evaluate_laws(m, t, step.length);
    const double change = sweep(m, step);
    if (!std::isfinite(change)) return FAILED;
    if (change <= tolerance || (n > 0 && change * change <= tolerance * std::max(before - change, 0.0))) {
      evaluate_laws(m, t, step.length);  // the momenta carried on must be those of the final gaps, or the ledger would drift
      collect_inputs(m);
      return CONVERGED;
    }
    if (n > 2 && change > SLOWEST * before) return FAILED;
    before = change;
  }
  return FAILED;
}

// Truncation of the drives relative to their spans and to what it may be.
inline double drive_error(const Modal& m) {
  double error = 0.0;
  if (m.steady) return error;
  for (int d = 0; d < m.sizes.drives; d++) {
    const int i = 2 * m.sizes.feet + d;
    const double span = m.player.cursor[d].span;
    if (!m.constant[i] && span != 0.0) error = std::max(error, m.nodes.truncation_of_drive(m.values[i]) / span);
  }
  for (int i = 0; m.laws.commanded() && i < m.sizes.feet; i++) {
    const int64_t c = m.laws.laws.volts[i];
    const double span = c < 0 ? 0.0 : m.player.cursor[c].span;
    if (span != 0.0) error = std::max(error, m.nodes.truncation_of_drive(m.volts[i]) / span);
  }
  return error * m.per_drive;
}

// Least slope of a film's momentum over a step in which that is monotonous. The differences over a step of a foot that hardly moves
// would be rounding.
inline double least_slope(const Modal& m, int foot, const Row& gap) {
  const double first = m.laws.momentum_slope(foot, gap[0], m.settings.probe);
  return std::min(std::fabs(first), std::fabs(m.laws.momentum_slope(foot, gap[N - 1], m.settings.probe)));
}

// Estimated error of a step relative to what it may be. A stiff film holds the gap: an error of its momentum moves it by
// no more than the film's own slope allows. After half an oscillation a force has not moved the gap at the end of the step, so
// it is weighted by the largest motion of the gap at any node.
inline double step_error(Modal& m, const StepClass& step, double t) {
  double worst = 0.0;
  m.growth_before = m.growth_after = 1.0;
  for (int i : m.acting) {
    if (i >= 2 * m.sizes.feet) break;
    const int foot = i % m.sizes.feet;
    const Row &v = m.values[i], &gap = m.outputs[foot];
    const double reach = step.reach[i], swing = std::fabs(gap[N - 1] - gap[0]);
    double yielding = swing > 0.0 ? reach * std::fabs(v[N - 1] - v[0]) / swing : 0.0;
    if (m.strong && i < m.sizes.feet) yielding = std::max(yielding, reach * least_slope(m, foot, gap));
    const double error = m.nodes.truncation(v) * reach / (1.0 + yielding) - m.rounding;
    if (error > worst) {
      worst = error;
      const double base = m.strong && i < m.sizes.feet ? m.feet[i].base : 0.0;
      m.growth_before = std::fabs(v[0] + base);
      m.growth_after = std::fabs(v[N - 1] + base);
      if (!(m.growth_before > 0.0 && m.growth_after > 0.0)) m.growth_before = m.growth_after = 1.0;
    }
  }
  for (int i : m.braked) {
    const int input = m.sizes.feet + i;
    double error = m.nodes.truncation(m.values[input]) * step.reach[input];
    if (m.laws.laws.friction_by_speed) error = std::max(error, bend_of_friction(m, step, i, t) / m.per_gap);
    if (error <= worst) continue;
    worst = error;
    m.growth_before = m.growth_after = 1.0;
  }
  return std::max(worst * m.per_gap, drive_error(m));
}

// Gaps, pulls and rates with the smooth forces of the free feet, from ``linear``. False where they do not converge.
inline bool converge_smooth(Modal& m, const StepClass& step, double t) {
  const ContactMode& mode = *m.mode;
  const int feet = m.sizes.feet;
  const bool smooth = !m.acting.empty() && m.acting[0] < 2 * feet;
  if (smooth) {
    Convergence converged = sweeps(m, step, t);
    if (converged == STIFF) converged = newton(m, step, t) ? CONVERGED : FAILED;
    if (converged != CONVERGED) return false;
  } else {
    for (int i : mode.free) {
      m.room[i] = 0.0;
      m.outputs[i] = m.linear[i];
    }
  }
  const auto add = [&](int o) { m.outputs[o] = smooth ? m.linear[o] + effect_on_held(m, step, o) : m.linear[o]; };
  for (int o : mode.held) add(o);
  for (int o : mode.stuck) add(feet + o);
  for (int o : mode.sliding) add(feet + o);
  return true;
}

// Collocate one step. Returns its error relative to what it may be, or NOT_CONVERGED.
template <class S>
TARSUS_APART double attempt(Modal& m, const StepClass& step, double t) {
  const ContactMode& mode = *m.mode;
  const int feet = m.sizes.feet;
  m.drive(t, step.length);
  for (int i = 0; i < feet; i++) {
    m.linear[i] = flowing_output<S>(m, step, i);
    if (mode.is_held[i] ? m.sizes.ways > 0 : m.rated) m.linear[feet + i] = flowing_output<S>(m, step, feet + i);
  }
  const auto converge = [&] { return converge_smooth(m, step, t); };
  if (m.braked.empty()) return converge() ? step_error(m, step, t) : NOT_CONVERGED;
  m.flowing = m.linear;
  return converge_friction(m, step, t, converge) ? step_error(m, step, t) : NOT_CONVERGED;
}

}  // namespace tarsus::modal
