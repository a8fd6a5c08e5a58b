// Friction along the ground on feet of a structure, coupled through it: within a step, at one moment, and in an impact.
//
// Friction (see march/friction.hpp) moves the structure, which changes the margin N + f_a = f_a - pull that bears it and the rate
// v: both are linear in the friction forces of all feet, so that Newton's method finds them, at the nodes of a step or at a
// moment. The direct effect of a friction force on its own margin is ``slide_feed``. Where that is as large as the share of the
// margin that the law makes the bound, friction presses a foot down harder than it is pushed: no motion of a rigid foot
// follows, or two do (Painleve), and the run ends as JAMMED.
#pragma once
#include "base/dense.hpp"
#include "march/friction.hpp"
#include "modal/flow.hpp"

namespace tarsus::modal {

// Pull [N] at which a foot detaches: the strength of its contact less its smooth force at zero gap.
template <class Real>
inline Real breaking_pull(const Modal& m, int foot, const Real& t, const Real& volts) {
  Real holds = m.laws.strength(foot, t - m.feet[foot].since, volts);
  if (m.laws.has(foot, HAS_FORCE)) holds -= m.laws.force(foot, Real(0.0), Real(0.0), volts, t);
  return holds;
}

// Bound below which a foot's margin counts as zero: by the scales of the scene, or its rounding; at the moment of an impact also
// that of the pull before it.
inline double no_margin(const Modal& m, int foot) {
  if (!m.mode->is_held[foot]) return m.no_gap(foot);
  const double parts = std::max(m.force_parts(foot), m.just_noted() ? m.feet[foot].forces : 0.0) + std::fabs(m.strength_now(foot));
  return m.settings.force_zero + ROUNDING * parts;
}

// Bound [m/s] below which a rate along the ground counts as zero.
inline double no_slide(const Modal& m, int foot) {
  return m.settings.speed_zero + ROUNDING * std::max(m.feet[foot].slides, m.parts(m.mode->slide_rate, foot));
}

inline double size_of(const Row& x) { return highest(magnitude(x)); }

// Whether a small matrix (size, size), used up, has positive pivots on its diagonal, the largest of those that are left first. Where it is 1 less the direct
// effects of friction forces on each other, friction then has exactly one solution: every force, those before it given, reduces the margin that bears it
// by less than that margin. Where it has one however few feet rub, all pivots are positive in any order.
inline bool has_positive_pivots(std::vector<double>& matrix, int size) {
  std::vector<uint8_t> left(size, 1);
  for (int n = 0; n < size; n++) {
    int p = -1;
    for (int c = 0; c < size; c++) {
      if (left[c] && (p < 0 || matrix[c * size + c] > matrix[p * size + p])) p = c;
    }
    if (!(matrix[p * size + p] > 0.0)) return false;
    left[p] = 0;
    for (int r = 0; r < size; r++) {
      const double factor = left[r] ? matrix[r * size + p] / matrix[p * size + p] : 0.0;
      for (int c = 0; c < size && factor != 0.0; c++) matrix[r * size + c] -= factor * matrix[p * size + c];
    }
  }
  return true;
}

// Solve a small system (size, size) in place of its right side; the matrix is used up.
inline void solve_in_order(std::vector<double>& matrix, int size, std::vector<double>& right) {
  for (int c = 0; c < size; c++) {
    for (int r = c + 1; r < size; r++) {
      const double factor = matrix[r * size + c] / matrix[c * size + c];
      for (int j = c; j < size; j++) matrix[r * size + j] -= factor * matrix[c * size + j];
      right[r] = right[r] - right[c] * factor;
    }
  }
  for (int r = size - 1; r >= 0; r--) {
    for (int j = r + 1; j < size; j++) right[r] = right[r] - right[j] * matrix[r * size + j];
    right[r] = right[r] / matrix[r * size + r];
  }
}

// --- within a step ---------------------------------------------------------------------------------------------------------

// What bears the friction of a foot that slides, at the nodes of a step.
struct Borne {
  Row margin, strength, speed;

  Borne(const Modal& m, const StepClass& step, int foot, double t) {
    const Row times = m.nodes.times() * step.length + t;
    margin = breaking_pull(m, foot, times, m.volts[foot]) - m.outputs[foot];
    strength = m.laws.strength(foot, times - m.feet[foot].since, m.volts[foot]);
    speed = m.outputs[m.sizes.feet + foot] * m.feet[foot].sense;
  }
};

inline SlidingBound bound_of(const Modal& m, int foot, const Borne& by) {
  return sliding_bound(m.laws, foot, by.margin, by.strength, by.speed, m.feet[foot].slide == FROM_REST);
}

// The friction of a foot that slides at the nodes: what the law says of the margin and the rate there, less what it is.
struct Sliding {
  Row misfit;
  SlidingBound bound;
};

inline Sliding sliding_at_nodes(const Modal& m, const StepClass& step, int foot, double t) {
  Sliding out{Row(0.0), bound_of(m, foot, Borne(m, step, foot, t))};
  out.misfit = out.bound.value * -m.feet[foot].sense - m.values[m.sizes.feet + foot];
  return out;
}

// Rounding [N] of the margin of a held foot at the nodes of a step. Films act on it by the change of their momenta, whose rounding makes the larger a
// force the shorter the step is.
inline double rounding_of_margin(const Modal& m, const StepClass& step, int foot) {
  const double* rate = m.mode->feed_rate + foot * m.sizes.inputs();
  double momenta = 0.0;
  for (int i : m.mode->free) {
    if (m.laws.has(i, HAS_MOMENTUM)) momenta += std::fabs(rate[i]) * size_of(m.values[i]);
  }
  return no_margin(m, foot) + ROUNDING * momenta / step.length;
}

// What a step misses of how friction bends with the slip speed, over what it may: see `bend_error`.
inline double bend_of_friction(const Modal& m, const StepClass& step, int foot, double t) {
  const Borne borne(m, step, foot, t);
  const auto between = [&m](const Row& values, double at) {
    const Row powers = powers_of(m.nodes, reinterpret_cast<const double*>(&values));
    return horner(reinterpret_cast<const double*>(&powers), 0, N, at);
  };
  const auto law = [&](double at, double speed) {
    Borne here = borne;
    here.margin = Row(between(borne.margin, at));
    here.strength = Row(between(borne.strength, at));
    here.speed = Row(speed);
    return bound_of(m, foot, here).value[0];
  };
  const Row bound = m.values[m.sizes.feet + foot] * -m.feet[foot].sense;
  return bend_error(m.nodes, bound, borne.speed, rounding_of_margin(m, step, foot), step.length, m.settings.end, law);
}

// The equations of Newton's method for all nodal friction forces: rows and columns by foot, then by node; the misfits last.
inline void assemble_friction(Modal& m, const StepClass& step, const std::vector<Sliding>& sliding) {
  const int count = int(m.braked.size()), size = count * N, width = size + 1;
  m.matrix.assign(size_t(size) * width, 0.0);
  for (int i = 0; i < count; i++) {
    const int foot = m.braked[i], along = m.sizes.feet + foot;
    const double sense = m.feet[foot].sense;
    const Row by_margin = sliding[i].bound.slope[MARGIN] * sense, &by_speed = sliding[i].bound.slope[SLIP_SPEED];
    for (int k = 0; k < count; k++) {
      const int input = m.sizes.feet + m.braked[k];
      const double *pull = step.from_input(foot, input), *rate = step.from_input(along, input);
      for (int l = 0; l < N; l++) {  // -sense (by_margin (-pull) + by_speed sense rate) on the right side
        const Row made = load(pull + l * N) * by_margin - load(rate + l * N) * by_speed;
        for (int j = 0; j < N; j++) m.matrix[(i * N + j) * width + k * N + l] = (i == k && j == l ? 1.0 : 0.0) - made[j];
      }
    }
    for (int j = 0; j < N; j++) m.matrix[(i * N + j) * width + size] = sliding[i].misfit[j];
  }
}

// Whether friction of the feet that slide has exactly one solution, by the slopes of its bounds by the margins.
inline bool has_one_solution(const Modal& m, const std::vector<double>& by_margin) {
  const int count = int(m.braked.size());
  std::vector<double> matrix(size_t(count) * count);
  for (int i = 0; i < count; i++) {
    const int foot = m.braked[i];
    for (int k = 0; k < count; k++) {
      const double feed = m.mode->feed[foot * m.sizes.inputs() + m.sizes.feet + m.braked[k]];
      matrix[i * count + k] = (i == k ? 1.0 : 0.0) - m.feet[foot].sense * by_margin[i] * feed;
    }
  }
  return has_positive_pivots(matrix, count);
}

// At the start of the step.
inline bool friction_is_unique(const Modal& m, const std::vector<Sliding>& sliding) {
  std::vector<double> by_margin;
  for (const Sliding& one : sliding) by_margin.push_back(one.bound.slope[MARGIN][0]);
  return has_one_solution(m, by_margin);
}

// Friction at the nodes of a step consistent with the margins and rates under it, by Newton's method; ``converge`` finds all
// outputs under the present friction forces. It is found to rounding, or a slide that begins from rest would stop at once; or,
// where films converge less exactly, until it no longer improves, within the tolerance of the drives' forces.
template <class Converge>
inline bool converge_friction(Modal& m, const StepClass& step, double t, const Converge& converge) {
  constexpr int MOST = 20;
  constexpr double SHARE = 0.05;     // of the error of a step that iterations may leave, as for smooth forces
  constexpr double ROUNDED = 1e-13;  // of a friction force
  constexpr double NO_GAIN = 0.1;    // share of its misfit to which an iteration that still converges reduces it, at least
  double before = INF;
  const int feet = m.sizes.feet;
  std::vector<Sliding> sliding;
  for (int i : m.braked) m.values[feet + i] = Row(m.values[feet + i][N - 1]);  // as the last step has left it
  for (int n = 0; n < MOST; n++) {
    for (int o = 0; o < 2 * feet; o++) {
      m.linear[o] = m.flowing[o];
      for (int i : m.braked) m.linear[o] += combine(step.from_input(o, feet + i), m.values[feet + i]);
    }
    if (!converge()) return false;
    sliding.clear();
    bool converged = true, enough = n > 0;
    double worst = 0.0;
    for (int i : m.braked) {
      sliding.push_back(sliding_at_nodes(m, step, i, t));
      const SlidingBound& bound = sliding.back().bound;
      if (!follows_growth(bound.slope[SLIP_SPEED], 0.0, step.reach[feet + i] / step.length)) return false;
      const double misfit = size_of(sliding.back().misfit), size = size_of(bound.value);
      if (!std::isfinite(misfit)) return false;
      const double none = no_margin(m, i) * (1.0 + size_of(bound.slope[MARGIN]));
      converged = converged && misfit <= ROUNDED * size + none;
      enough = enough && misfit <= SHARE * m.settings.drive * size + none;
      worst = std::max(worst, misfit);
    }
    converged = converged || (enough && worst > NO_GAIN * before);
    before = worst;
    if (n == 0 && !friction_is_unique(m, sliding)) {
      m.jammed = true;
      return false;
    }
    if (converged) return true;
    assemble_friction(m, step, sliding);
    const int size = int(m.braked.size()) * N;
    if (!eliminate(m.matrix.data(), size, size + 1)) return false;
    for (int r = 0; r < size; r++) {
      Row& force = m.values[feet + m.braked[r / N]];
      force.set(r % N, force[r % N] + m.matrix[r * (size + 1) + size]);
    }
  }
  return false;
}

// --- at one moment ---------------------------------------------------------------------------------------------------------

// Pull of the robot on a foot at the ground by rows of the state, of the inputs and of what is constant, without the
// ground's own forces on it.
inline double robot_pull(const Modal& m, const double* rows, const double* feeds, double bias, int foot) {
  const size_t feed = size_t(foot) * m.sizes.inputs() + 2 * m.sizes.feet;
  double pull = m.along(rows, foot) + bias;
  for (int d = 0; d < m.sizes.drives; d++) {
    if (feeds[feed + d] != 0.0) pull += feeds[feed + d] * m.player.value(d, m.clock.time);
  }
  return pull;
}

// Pull that breaks the contact of a foot off now [N]: its strength less its smooth force at zero gap.
inline double breaking_now(Modal& m, int foot) {
  return breaking_pull(m, foot, m.clock.time, m.volts_now(foot));
}

// An output of a held foot by the state (momenta of films included), the drives, and the forces on all feet but friction.
inline double force_on_held(Modal& m, int output, const std::vector<double>& forces) {
  const int feet = m.sizes.feet;
  const size_t feed = size_t(output) * m.sizes.inputs();
  double sum = robot_pull(m, m.mode->outputs, m.mode->feed, m.bias->feed[output], output);
  for (int k : m.mode->free) sum = sum + m.mode->feed[feed + feet + k] * forces[k];
  for (int k : m.mode->stuck) sum = sum + m.mode->feed[feed + feet + k] * m.feet[k].place;
  return sum;
}

// Forces at the feet at one moment: the structure's pull on each held foot, its force along the ground on one that sticks, and
// friction on one that slides [N]; a foot that has no sense of sliding has none.
struct Moment {
  std::vector<double> pull, along, friction;
};

// Friction of the feet that slide, by the pulls without it, which it is added to: Newton's method.
inline void add_friction(Modal& m, Moment& to) {
  constexpr int MOST = 20;
  constexpr double SAME_FORCE = 1e-13;  // of a friction force: a smaller change by Newton's method is rounding
  const int feet = m.sizes.feet, ni = m.sizes.inputs();
  std::vector<int> braked;
  for (int i : m.mode->sliding) {
    if (m.feet[i].sense != 0.0) braked.push_back(i);
  }
  const int count = int(braked.size());
  std::vector<double> matrix(size_t(count) * count);
  std::vector<double> right(count, 0.0);
  bool converged = count == 0, last = false;
  for (int n = 0; n < MOST && !last; n++) {
    last = converged;  // and once more: what is left then is the rounding of the forces alone
    converged = true;
    for (int a = 0; a < count; a++) {
      const int i = braked[a];
      const double sense = m.feet[i].sense;
      double margin = breaking_now(m, i) - to.pull[i];
      for (int k : braked) margin = margin - m.mode->feed[size_t(i) * ni + feet + k] * to.friction[k];
      const double strength = m.strength_now(i), speed = magnitude(m.along(m.mode->outputs, feet + i)) + LEAST_SLIP;
      const double by_margin = sliding_bound(m.laws, i, Row(margin), Row(strength), Row(speed), false).slope[MARGIN][0];
      for (int b = 0; b < count; b++) {
        matrix[a * count + b] = (a == b) - sense * by_margin * m.mode->feed[i * ni + feet + braked[b]];
      }
      right[a] = m.laws.friction(i, margin, strength, speed) * -sense - to.friction[i];
    }
    solve_in_order(matrix, count, right);
    for (int a = 0; a < count; a++) {
      double& force = to.friction[braked[a]];
      force = force + right[a];
      converged = converged && std::fabs(right[a]) <= SAME_FORCE * std::fabs(force) + m.settings.force_zero;
    }
  }
  for (int k : braked) {
    for (int i : m.mode->held) to.pull[i] = to.pull[i] + m.mode->feed[size_t(i) * ni + feet + k] * to.friction[k];
    for (int i : m.mode->stuck) {
      to.along[i] = to.along[i] + m.mode->feed[size_t(feet + i) * ni + feet + k] * to.friction[k];
    }
  }
}

// Of the modal state, with the gaps as they are known.
inline Moment moment_of(Modal& m) {
  const std::vector<double> zero(m.sizes.feet, 0.0);
  std::vector<double> forces = zero;
  for (int k : m.mode->free) {
    const double rate = m.rate_of(k);
    if (m.laws.has(k, HAS_MOMENTUM)) forces[k] = rate * m.laws.momentum_slope(k, m.gaps[k], m.settings.probe);
    if (m.laws.has(k, HAS_FORCE)) forces[k] = forces[k] + m.force_now(k, m.gaps[k], rate);
  }
  Moment out{zero, zero, zero};
  for (int i : m.mode->held) out.pull[i] = force_on_held(m, i, forces);
  for (int i : m.mode->stuck) out.along[i] = force_on_held(m, m.sizes.feet + i, forces);
  add_friction(m, out);
  return out;
}

// --- in an impact ----------------------------------------------------------------------------------------------------------

inline Mobilities mobilities_of(const Modal& m, int foot) {
  Mobilities out{m.mode->mobility[foot], 0.0, 0.0};
  for (int k = 0; k < m.sizes.state(); k++) {
    const size_t at = size_t(foot) * m.sizes.state() + k;
    const double rate = m.mode->slide_rate[at];
    out.across = out.across + m.mode->beta[at] * rate;
    out.along = out.along + m.mode->slide[at] * rate;
  }
  return out;
}

// The effect of friction in an impact on a foot.
inline Braking braking_of(Modal& m, int foot, double speed, double after) {
  if (!m.frictional[foot]) return {0.0, 0.0, 0.0};
  return impact_friction(m.laws, foot, mobilities_of(m, foot), speed, after, m.along(m.mode->slide_rate, foot));
}

// Give the foot that friction impulse; its normal rate stays what it is.
inline void brake(Modal& m, int foot, double impulse) {
  if (impulse == 0.0) return;
  m.shift(m.mode->slide, foot, impulse);
  m.shift(m.mode->jump, foot, -impulse * mobilities_of(m, foot).across);
}

}  // namespace tarsus::modal
