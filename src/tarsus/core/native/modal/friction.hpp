// Friction along the ground on feet that know their way: within a step, at one moment, and in an impact.
//
// A foot on the ground sticks, held along the ground where it is, or slides with the friction F = -sense * bound(N + f_a, f_a,
// |v|) [N] of the law. Friction moves the structure, which changes the margin N + f_a = f_a - pull that bears it and the rate
// v: both are linear in the friction forces of all feet, so that Newton's method finds them, at the nodes of a step or at a
// moment. What a friction force does to its own margin at once is ``slide_feed``. Where that is as much as the law takes of the
// margin, friction presses a foot down harder than it is pushed: no motion of a rigid foot follows, or two do (Painleve), and
// the run ends as JAMMED.
#pragma once
#include "base/dense.hpp"
#include "march/rules.hpp"
#include "modal/flow.hpp"

namespace tarsus::modal {

// Pull that breaks the contact of a foot off [N]: its strength less its smooth force at zero gap.
template <class Real>
inline Real breaking_pull(const Modal& m, int foot, const Real& t, const Real& volts) {
  Real holds = m.laws.strength(foot, t - m.feet[foot].since);
  if (m.laws.has(foot, HAS_FORCE)) holds -= m.laws.force(foot, Real(0.0), Real(0.0), volts, t);
  return holds;
}

// Size [N] of what adds up to the force on what is held of a foot.
inline double force_parts(const Modal& m, int output) {
  double parts = m.parts(m.mode->outputs, output) + std::fabs(m.bias->feed[output]);
  for (int i : m.inputs) parts += std::fabs(m.mode->feed[output * m.sizes.inputs() + i] * m.value(i)[0]);
  return parts;
}

// Below which a foot's margin is zero: by the scene's scales, or for all that rounding leaves of what adds up to it.
inline double no_margin(const Modal& m, int foot) {
  if (!m.mode->is_held[foot]) return m.no_gap(foot);
  const double parts = force_parts(m, foot) + std::fabs(m.laws.strength(foot, m.clock.time - m.feet[foot].since));
  return m.settings.force_zero + ROUNDING * parts;
}

// Rate [m/s] along the ground that is none.
inline double no_slide(const Modal& m, int foot) {
  return m.settings.speed_zero + ROUNDING * std::max(m.feet[foot].slides, m.parts(m.mode->slide_rate, foot));
}

// Largest friction of a foot, and its slopes by margin (by a difference, which a law linear in it does not feel) and by speed.
template <class Real>
struct Bound {
  Real most, by_margin, by_speed;
};

inline double size_of(double x) { return std::fabs(x); }
inline double size_of(const Row& x) { return highest(magnitude(x)); }

template <class Real>
inline Bound<Real> friction_bound(const Modal& m, int foot, const Real& margin, const Real& strength, const Real& speed) {
  constexpr double SHARE = 1e-5;  // of a number, over which differences leave as much rounding as a law's bend
  const double more = SHARE * size_of(margin) + m.settings.force_zero;
  Bound<Real> out{m.laws.friction(foot, margin, strength, speed), Real(0.0), Real(0.0)};
  out.by_margin = (m.laws.friction(foot, margin + Real(more), strength, speed) -
                   m.laws.friction(foot, margin - Real(more), strength, speed)) / (2.0 * more);
  return out;
}

// That of a foot that slides, at the nodes. Beyond a stop (speed [m/s] below 0, in the sense of the slide) it stays what it is at rest,
// as under walkers.
inline Bound<Row> sliding_bound(const Modal& m, int foot, const Row& margin, const Row& strength, const Row& speed) {
  const Row ahead = larger(speed, Row(0.0));
  Bound<Row> out = friction_bound(m, foot, margin, strength, ahead);
  if (!m.laws.laws.friction_by_speed) return out;
  const auto found = m.laws.friction_by_speed(foot, margin, strength, ahead);
  out.most = found.value;
  out.by_speed = each(found.slope[0], speed, [](double by, double at) { return at > 0.0 && std::isfinite(by) ? by : 0.0; });
  return out;
}

// Whether friction has one answer: every friction force, those before it given, takes less of the margin that bears it than it
// has. matrix (size, size + 1): 1 less what friction forces make of each other at once; used up.
inline bool has_one_answer(std::vector<double>& matrix, int size) {
  for (int c = 0; c < size; c++) {
    const double pivot = matrix[c * (size + 1) + c];
    if (!(pivot > 0.0)) return false;
    for (int r = c + 1; r < size; r++) {
      const double factor = matrix[r * (size + 1) + c] / pivot;
      for (int j = c; j < size; j++) matrix[r * (size + 1) + j] -= factor * matrix[c * (size + 1) + j];
    }
  }
  return true;
}

// The slope by the margin alone, of numbers.
template <class M, class Real>
inline double bound_slope(const M& m, int foot, const Real& margin, const Real& strength, const Real& speed) {
  constexpr double SHARE = 1e-5;
  const double more = SHARE * std::fabs(value_of(margin)) + m.settings.force_zero;
  const auto at = [&](double x) { return value_of(m.laws.friction(foot, Real(x), strength, speed)); };
  return (at(value_of(margin) + more) - at(value_of(margin) - more)) / (2.0 * more);
}

// Solve a small system in place of its right side, whose numbers may have derivatives; the matrix (size, size + 1) is used up.
template <class Real>
inline void solve_small(std::vector<double>& matrix, int size, std::vector<Real>& right) {
  const int width = size + 1;
  for (int c = 0; c < size; c++) {
    for (int r = c + 1; r < size; r++) {
      const double factor = matrix[r * width + c] / matrix[c * width + c];
      for (int j = c; j < size; j++) matrix[r * width + j] -= factor * matrix[c * width + j];
      right[r] = right[r] - right[c] * factor;
    }
  }
  for (int r = size - 1; r >= 0; r--) {
    for (int j = r + 1; j < size; j++) right[r] = right[r] - right[j] * matrix[r * width + j];
    right[r] = right[r] / matrix[r * width + r];
  }
}

// --- within a step ---------------------------------------------------------------------------------------------------------

// The friction of a foot that slides at the nodes: what the law says of the margin and the rate there, less what it is.
struct Sliding {
  Row misfit;
  Bound<Row> bound;
};

inline Sliding sliding_at_nodes(const Modal& m, const StepClass& step, int foot, double t) {
  const int along = m.sizes.feet + foot;
  const Row times = m.nodes.times() * step.length + t;
  const Row margin = breaking_pull(m, foot, times, m.volts[foot]) - m.outputs[foot];
  const Row strength = m.laws.strength(foot, times - m.feet[foot].since);
  const double sense = m.feet[foot].sense;
  Sliding out{Row(0.0), sliding_bound(m, foot, margin, strength, m.outputs[along] * sense)};
  out.misfit = out.bound.most * -sense - m.values[along];
  return out;
}

// The equations of Newton's method for all nodal friction forces: rows and columns by foot, then by node; the misfits last.
inline void assemble_friction(Modal& m, const StepClass& step, const std::vector<Sliding>& sliding) {
  const int count = int(m.rubbing.size()), size = count * N, width = size + 1;
  m.matrix.assign(size_t(size) * width, 0.0);
  for (int i = 0; i < count; i++) {
    const int foot = m.rubbing[i], along = m.sizes.feet + foot;
    const double sense = m.feet[foot].sense;
    const Row by_margin = sliding[i].bound.by_margin * sense, by_speed = sliding[i].bound.by_speed;
    for (int k = 0; k < count; k++) {
      const int input = m.sizes.feet + m.rubbing[k];
      const double *pull = step.from_input(foot, input), *rate = step.from_input(along, input);
      for (int l = 0; l < N; l++) {  // -sense (by_margin (-pull) + by_speed sense rate) on the right side
        const Row made = load(pull + l * N) * by_margin - load(rate + l * N) * by_speed;
        for (int j = 0; j < N; j++) m.matrix[(i * N + j) * width + k * N + l] = (i == k && j == l ? 1.0 : 0.0) - made[j];
      }
    }
    for (int j = 0; j < N; j++) m.matrix[(i * N + j) * width + size] = sliding[i].misfit[j];
  }
}

// Whether friction has one answer at the start of the step.
inline bool friction_is_unique(const Modal& m, const std::vector<Sliding>& sliding) {
  const int count = int(m.rubbing.size());
  std::vector<double> matrix(size_t(count) * (count + 1));
  for (int i = 0; i < count; i++) {
    const int foot = m.rubbing[i];
    for (int k = 0; k < count; k++) {
      const double feed = m.mode->feed[foot * m.sizes.inputs() + m.sizes.feet + m.rubbing[k]];
      matrix[i * (count + 1) + k] = (i == k ? 1.0 : 0.0) - m.feet[foot].sense * sliding[i].bound.by_margin[0] * feed;
    }
  }
  return has_one_answer(matrix, count);
}

// Friction at the nodes of a step consistent with the margins and rates that it leaves, by Newton's method; ``settle`` makes all
// outputs with the friction forces as they are. It is found to rounding, or a slide that begins from rest would stop at once; or, where
// films settle less exactly, as far as that goes, and as well as the forces of drives are known.
template <class Settle>
inline bool settle_friction(Modal& m, const StepClass& step, double t, const Settle& settle) {
  constexpr int MOST = 20;
  constexpr double SHARE = 0.05;     // of the error of a step that iterations may leave, as for smooth forces
  constexpr double ROUNDED = 1e-13;  // of a friction force
  double before = INF;
  const int feet = m.sizes.feet;
  std::vector<Sliding> sliding;
  for (int i : m.rubbing) m.values[feet + i] = Row(m.values[feet + i][N - 1]);  // as the last step has left it
  for (int n = 0; n < MOST; n++) {
    for (int o = 0; o < 2 * feet; o++) {
      m.linear[o] = m.flowing[o];
      for (int i : m.rubbing) m.linear[o] += combine(step.from_input(o, feet + i), m.values[feet + i]);
    }
    if (!settle()) return false;
    sliding.clear();
    bool settled = true, enough = n > 0;
    double worst = 0.0;
    for (int i : m.rubbing) {
      sliding.push_back(sliding_at_nodes(m, step, i, t));
      const Bound<Row>& bound = sliding.back().bound;
      // most powers of e by which friction that falls with the speed may drive a foot within a step, as under walkers: an implicit
      // step far longer than that finds a motion of the other sign
      if (-lowest(bound.by_speed) * step.reach[feet + i] > step.length) return false;
      const double misfit = size_of(sliding.back().misfit), size = size_of(bound.most);
      if (!std::isfinite(misfit) || !finite(bound.by_margin + bound.by_speed)) return false;
      const double none = no_margin(m, i) * (1.0 + size_of(bound.by_margin));
      settled = settled && misfit <= ROUNDED * size + none;
      enough = enough && misfit <= SHARE * m.settings.drive * size + none;
      worst = std::max(worst, misfit);
    }
    settled = settled || (enough && worst > 0.1 * before);
    before = worst;
    if (n == 0 && !friction_is_unique(m, sliding)) {
      m.jammed = true;
      return false;
    }
    if (settled) return true;
    assemble_friction(m, step, sliding);
    const int size = int(m.rubbing.size()) * N;
    if (!eliminate(m.matrix.data(), size, size + 1)) return false;
    for (int r = 0; r < size; r++) {
      Row& force = m.values[feet + m.rubbing[r / N]];
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
  constexpr double SETTLED = 1e-13;  // of a friction force, that Newton's method no longer moves it
  const int feet = m.sizes.feet, ni = m.sizes.inputs();
  std::vector<int> rubbing;
  for (int i : m.mode->sliding) {
    if (m.sense_of(i) != 0.0) rubbing.push_back(i);
  }
  const int count = int(rubbing.size());
  std::vector<double> matrix(size_t(count) * (count + 1));
  std::vector<Real> right(count, Real(0.0));
  bool settled = count == 0, last = false;
  for (int n = 0; n < MOST && !last; n++) {
    last = settled;  // once more than numbers need, for derivatives
    settled = true;
    for (int a = 0; a < count; a++) {
      const int i = rubbing[a];
      const double sense = m.sense_of(i);
      Real margin = breaking_now(m, i) - to.pull[i];
      for (int k : rubbing) margin = margin - m.product(&ContactMode::feed, size_t(i) * ni + feet + k, to.friction[k]);
      const Real strength = m.strength_now(i), speed = magnitude(m.along(&ContactMode::outputs, feet + i));
      const double by_margin = bound_slope(m, i, margin, strength, speed);
      for (int b = 0; b < count; b++) {
        matrix[a * (count + 1) + b] = (a == b) - sense * by_margin * m.mode->feed[i * ni + feet + rubbing[b]];
      }
      right[a] = m.laws.friction(i, margin, strength, speed) * -sense - to.friction[i];
    }
    solve_small(matrix, count, right);
    for (int a = 0; a < count; a++) {
      Real& force = to.friction[rubbing[a]];
      force = force + right[a];
      settled = settled && std::fabs(value_of(right[a])) <= SETTLED * std::fabs(value_of(force)) + m.settings.force_zero;
    }
  }
  for (int k : rubbing) {
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

// Of a foot that sticks, at this moment, of the modal state [N]: its margin, what friction has to bear, and what it can.
template <class Real>
struct Bearing {
  Real margin, along, most;
};

template <class M>
inline Bearing<typename M::Real> bearing_of(M& m, int foot) {
  const Moment<typename M::Real> at = moment_of(m);
  const typename M::Real margin = breaking_now(m, foot) - at.pull[foot];
  return {margin, at.along[foot], m.laws.friction(foot, margin, m.strength_now(foot), typename M::Real(0.0))};
}

// --- in an impact ----------------------------------------------------------------------------------------------------------

// Rates of a free foot per unit impulse [1/kg]: normal by normal, along the ground by normal and the other way round, along by
// along.
template <class Real>
struct Mobilities {
  Real normal, across, along;
};

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

// Friction impulse [N s] along the ground on a foot that an impact throws back, and the kinetic energy [J] that it takes beyond
// what restitution takes; doubtful: whether it stops the foot is within CLOSE of its threshold.
template <class Real>
struct Braking {
  Real impulse, lost;
  bool doubtful = false;
};

// Of all impulses that Coulomb's law allows, |p_t| <= ratio p_n, the one that leaves the least kinetic energy where the foot departs
// with the speed ``after``. It stops what the foot has along the ground when restitution begins, or brakes that as much as it
// may. So no impact ever adds energy, however the two ways are coupled (Kane's paradox); where they are not, the foot stops or is
// braked by ratio times the change of its normal rate.
template <class Real>
inline Braking<Real> braking(const Mobilities<Real>& by, const Real& speed, const Real& after, const Real& along, const Real& ratio) {
  const Real coupling = by.across / by.normal, slip = along + speed * coupling, mobility = by.along - by.across * coupling;
  Braking<Real> out{Real(0.0), Real(0.0)};
  if (value_of(slip) == 0.0 || !(value_of(mobility) > 0.0)) return out;
  const bool forward = value_of(slip) > 0.0;
  out.impulse = -slip / mobility;
  const Real turned = forward ? -ratio : ratio, room = by.normal + turned * by.across;  // p_t = turned p_n
  if (value_of(room) > 0.0) {
    const Real most = turned * (speed + after) / room;
    out.doubtful = is_close(out.impulse, most);
    if (forward ? value_of(out.impulse) < value_of(most) : value_of(most) < value_of(out.impulse)) out.impulse = most;
  }
  out.lost = -out.impulse * (slip + 0.5 * out.impulse * mobility);
  return out;
}

// That of an impact on a foot. The ratio is what the law takes of a push alone: adhesion is a force, and brakes nothing in no time.
template <class M>
inline Braking<typename M::Real> braking_of(M& m, int foot, const typename M::Real& speed, const typename M::Real& after) {
  typedef typename M::Real Real;
  if (!m.frictional[foot]) return {Real(0.0), Real(0.0)};
  const Real along = m.along(&ContactMode::slide_rate, foot), change = speed + after;
  const Real ratio = m.laws.friction(foot, change, Real(0.0), magnitude(along)) / change;
  return braking(mobilities_of(m, foot), speed, after, along, ratio);
}

// Give the foot that friction impulse; its normal rate stays what it is.
template <class M>
inline void brake(M& m, int foot, const typename M::Real& impulse) {
  if (is_nothing(impulse)) return;
  m.shift(&ContactMode::slide, foot, impulse);
  m.shift(&ContactMode::jump, foot, -impulse * mobilities_of(m, foot).across);
}

}  // namespace tarsus::modal
