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

// Solve a small system (size, size) in place of its right side, whose numbers may have derivatives; the matrix is used up.
template <class Real>
inline void solve_in_order(std::vector<double>& matrix, int size, std::vector<Real>& right) {
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
  return bend_error(m.nodes, bound, borne.speed, step.length, m.settings.end, law);
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

// Whether friction has exactly one solution at the start of the step.
inline bool friction_is_unique(const Modal& m, const std::vector<Sliding>& sliding) {
  const int count = int(m.braked.size());
  std::vector<double> matrix(size_t(count) * count);
  for (int i = 0; i < count; i++) {
    const int foot = m.braked[i];
    for (int k = 0; k < count; k++) {
      const double feed = m.mode->feed[foot * m.sizes.inputs() + m.sizes.feet + m.braked[k]];
      matrix[i * count + k] = (i == k ? 1.0 : 0.0) - m.feet[foot].sense * sliding[i].bound.slope[MARGIN][0] * feed;
    }
  }
  return has_positive_pivots(matrix, count);
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
//
// As the maps of modal/contact.hpp, for numbers and for numbers with derivatives.

// Pull of the robot on a foot at the ground by rows of the state, of the inputs and of what is constant, without the
// ground's own forces on it.
template <class M>
inline typename M::Real robot_pull(const M& m, ModeArray rows, ModeArray feeds, const typename M::Real& bias, int foot) {
  const size_t feed = size_t(foot) * m.sizes.inputs() + 2 * m.sizes.feet;
  typename M::Real pull = m.along(rows, foot) + bias;
  for (int d = 0; d < m.sizes.drives; d++) {
    if (!is_nothing(m.entry(feeds, feed + d))) pull = pull + m.product(feeds, feed + d, m.drive_now(d));
  }
  return pull;
}

// Pull that breaks the contact of a foot off now [N]: its strength less its smooth force at zero gap.
template <class M>
inline typename M::Real breaking_now(M& m, int foot) {
  typedef typename M::Real Real;
  Real holds = m.strength_now(foot);
  if (m.laws.has(foot, HAS_FORCE)) holds = holds - m.force_now(foot, Real(0.0), Real(0.0));
  return holds;
}

// An output of a held foot by the state (momenta of films included), the drives, and the forces on all feet but friction.
template <class M>
inline typename M::Real force_on_held(M& m, int output, const std::vector<typename M::Real>& forces) {
  const int feet = m.sizes.feet;
  const size_t feed = size_t(output) * m.sizes.inputs();
  typename M::Real sum = robot_pull(m, &ContactMode::outputs, &ContactMode::feed, m.feed_bias(output), output);
  for (int k : m.mode->free) sum = sum + m.product(&ContactMode::feed, feed + feet + k, forces[k]);
  for (int k : m.mode->stuck) sum = sum + m.product(&ContactMode::feed, feed + feet + k, m.place_of(k));
  return sum;
}

// Forces at the feet at one moment: the structure's pull on each held foot, its force along the ground on one that sticks, and
// friction on one that slides [N]; a foot that has no sense of sliding has none.
template <class Real>
struct Moment {
  std::vector<Real> pull, along, friction;
};

// Friction of the feet that slide, by the pulls without it, which it is added to: Newton's method, once more with derivatives.
template <class M>
inline void add_friction(M& m, Moment<typename M::Real>& to) {
  typedef typename M::Real Real;
  constexpr int MOST = 20;
  constexpr double SAME_FORCE = 1e-13;  // of a friction force: a smaller change by Newton's method is rounding
  const int feet = m.sizes.feet, ni = m.sizes.inputs();
  std::vector<int> braked;
  for (int i : m.mode->sliding) {
    if (m.sense_of(i) != 0.0) braked.push_back(i);
  }
  const int count = int(braked.size());
  std::vector<double> matrix(size_t(count) * count);
  std::vector<Real> right(count, Real(0.0));
  bool converged = count == 0, last = false;
  for (int n = 0; n < MOST && !last; n++) {
    last = converged;  // one more iteration than the values need, for derivatives
    converged = true;
    for (int a = 0; a < count; a++) {
      const int i = braked[a];
      const double sense = m.sense_of(i);
      Real margin = breaking_now(m, i) - to.pull[i];
      for (int k : braked) margin = margin - m.product(&ContactMode::feed, size_t(i) * ni + feet + k, to.friction[k]);
      const Real strength = m.strength_now(i), speed = magnitude(m.along(&ContactMode::outputs, feet + i)) + Real(LEAST_SLIP);
      const double by_margin = sliding_bound(m.laws.plain(), i, Row(value_of(margin)), Row(value_of(strength)), Row(value_of(speed)), false)
                                   .slope[MARGIN][0];
      for (int b = 0; b < count; b++) {
        matrix[a * count + b] = (a == b) - sense * by_margin * m.mode->feed[i * ni + feet + braked[b]];
      }
      right[a] = m.laws.friction(i, margin, strength, speed) * -sense - to.friction[i];
    }
    solve_in_order(matrix, count, right);
    for (int a = 0; a < count; a++) {
      Real& force = to.friction[braked[a]];
      force = force + right[a];
      converged = converged && std::fabs(value_of(right[a])) <= SAME_FORCE * std::fabs(value_of(force)) + m.settings.force_zero;
    }
  }
  for (int k : braked) {
    for (int i : m.mode->held) to.pull[i] = to.pull[i] + m.product(&ContactMode::feed, size_t(i) * ni + feet + k, to.friction[k]);
    for (int i : m.mode->stuck) {
      to.along[i] = to.along[i] + m.product(&ContactMode::feed, size_t(feet + i) * ni + feet + k, to.friction[k]);
    }
  }
}

// Of the modal state, with the gaps as they are known.
template <class M>
inline Moment<typename M::Real> moment_of(M& m) {
  typedef typename M::Real Real;
  const std::vector<Real> zero(m.sizes.feet, Real(0.0));
  std::vector<Real> forces = zero;
  for (int k : m.mode->free) {
    const Real rate = m.rate_of(k);
    if (m.laws.has(k, HAS_MOMENTUM)) forces[k] = rate * m.laws.momentum_slope(k, m.gaps[k], m.settings.probe);
    if (m.laws.has(k, HAS_FORCE)) forces[k] = forces[k] + m.force_now(k, m.gaps[k], rate);
  }
  Moment<Real> out{zero, zero, zero};
  for (int i : m.mode->held) out.pull[i] = force_on_held(m, i, forces);
  for (int i : m.mode->stuck) out.along[i] = force_on_held(m, m.sizes.feet + i, forces);
  add_friction(m, out);
  return out;
}

// The force that friction has to bear under a foot that sticks, and the most that it can, at this moment, from the modal state.
template <class M>
inline Bearing<typename M::Real> bearing_of(M& m, int foot) {
  const Moment<typename M::Real> at = moment_of(m);
  return {m.laws, foot, breaking_now(m, foot) - at.pull[foot], m.strength_now(foot), at.along[foot]};
}

// --- in an impact ----------------------------------------------------------------------------------------------------------

template <class M>
inline Mobilities<typename M::Real> mobilities_of(const M& m, int foot) {
  typedef typename M::Real Real;
  Mobilities<Real> out{m.entry(&ContactMode::mobility, foot), Real(0.0), Real(0.0)};
  for (int k = 0; k < m.sizes.state(); k++) {
    const size_t at = size_t(foot) * m.sizes.state() + k;
    const Real rate = m.entry(&ContactMode::slide_rate, at);
    out.across = out.across + m.product(&ContactMode::beta, at, rate);
    out.along = out.along + m.product(&ContactMode::slide, at, rate);
  }
  return out;
}

// The effect of friction in an impact on a foot.
template <class M>
inline Braking<typename M::Real> braking_of(M& m, int foot, const typename M::Real& speed, const typename M::Real& after) {
  typedef typename M::Real Real;
  if (!m.frictional[foot]) return {Real(0.0), Real(0.0), Real(0.0)};
  return impact_friction(m.laws, foot, mobilities_of(m, foot), speed, after, m.along(&ContactMode::slide_rate, foot));
}

// Give the foot that friction impulse; its normal rate stays what it is.
template <class M>
inline void brake(M& m, int foot, const typename M::Real& impulse) {
  if (is_nothing(impulse)) return;
  m.shift(&ContactMode::slide, foot, impulse);
  m.shift(&ContactMode::jump, foot, -impulse * mobilities_of(m, foot).across);
}

}  // namespace tarsus::modal
