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

// Largest friction of a foot, and its slopes by margin and speed, by differences that a law linear in them does not feel.
template <class Real>
struct Bound {
  Real most, by_margin, by_speed;
};

inline double size_of(double x) { return std::fabs(x); }
inline double size_of(const Row& x) { return highest(magnitude(x)); }
inline double magnitude(double x) { return std::fabs(x); }

template <class Real>
inline Bound<Real> friction_bound(const Modal& m, int foot, const Real& margin, const Real& strength, const Real& speed) {
  constexpr double SHARE = 1e-5;  // of a number, over which differences leave as much rounding as a law's bend
  const double more = SHARE * size_of(margin) + m.settings.force_zero, faster = SHARE * size_of(speed) + m.settings.speed_zero;
  Bound<Real> out{m.laws.friction(foot, margin, strength, speed), Real(0.0), Real(0.0)};
  out.by_margin = (m.laws.friction(foot, margin + Real(more), strength, speed) -
                   m.laws.friction(foot, margin - Real(more), strength, speed)) / (2.0 * more);
  if (m.laws.laws.friction_by_speed) {
    out.by_speed = (m.laws.friction(foot, margin, strength, speed + Real(faster)) - out.most) / faster;
  }
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
  Sliding out{Row(0.0), friction_bound(m, foot, margin, strength, magnitude(m.outputs[along]))};
  out.misfit = out.bound.most * -sense - m.values[along];
  // beyond its stop a foot is faster the farther it has turned back
  out.bound.by_speed = each(out.bound.by_speed, m.outputs[along], [sense](double by, double rate) { return rate * sense < 0.0 ? -by : by; });
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
// outputs with the friction forces as they are. They are known as well as the forces of drives are.
template <class Settle>
inline bool settle_friction(Modal& m, const StepClass& step, double t, const Settle& settle) {
  constexpr int MOST = 20;
  constexpr double SHARE = 0.05;  // of the error of a step that iterations may leave, as for smooth forces
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
    bool settled = true;
    for (int i : m.rubbing) {
      sliding.push_back(sliding_at_nodes(m, step, i, t));
      const Bound<Row>& bound = sliding.back().bound;
      const double misfit = size_of(sliding.back().misfit), size = size_of(bound.most);
      if (!std::isfinite(misfit) || !finite(bound.by_margin + bound.by_speed)) return false;
      settled = settled && misfit <= SHARE * m.settings.drive * size + no_margin(m, i) * (1.0 + size_of(bound.by_margin));
    }
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

// Forces at the feet at one moment in a contact mode: the structure's pull on each held foot, its force along the ground on one
// that sticks, and friction on one that slides [N].
struct Moment {
  std::vector<double> pull, along, friction;
};

// Of a state (momenta of films included) of any contact mode, with the gaps as they are known. A foot that has no sense of
// sliding yet is without friction.
inline Moment moment_in(const Modal& m, const ContactMode& mode, const BiasMode& bias, const double* y, double t) {
  const int feet = m.sizes.feet, ni = m.sizes.inputs(), size = m.sizes.state();
  const auto row = [&](int o) {
    double sum = bias.feed[o];
    for (int k = 0; k < size; k++) sum += mode.outputs[o * size + k] * y[k];
    return sum;
  };
  std::vector<double> force(feet, 0.0), rate(feet, 0.0);
  for (int k : mode.free) {
    rate[k] = row(feet + k);
    if (m.laws.has(k, HAS_MOMENTUM)) force[k] = rate[k] * m.laws.momentum_slope(k, m.gaps[k], m.settings.probe);
    if (m.laws.has(k, HAS_FORCE)) force[k] += m.laws.force(k, m.gaps[k], rate[k], m.foot_volts(k, t), t);
  }
  const auto total_of = [&](int o) {
    const double* feed = mode.feed + o * ni;
    double sum = row(o);
    for (int d = 0; d < m.sizes.drives; d++) {
      if (feed[2 * feet + d] != 0.0) sum += feed[2 * feet + d] * m.player.value(d, t);
    }
    for (int k : mode.free) sum += feed[feet + k] * force[k];
    for (int k : mode.stuck) sum += feed[feet + k] * m.feet[k].place;
    return sum;
  };
  Moment out{std::vector<double>(feet, 0.0), std::vector<double>(feet, 0.0), std::vector<double>(feet, 0.0)};
  for (int i : mode.held) out.pull[i] = total_of(i);
  for (int i : mode.stuck) out.along[i] = total_of(feet + i);
  std::vector<int> rubbing;
  for (int i : mode.sliding) {
    if (m.feet[i].sense != 0.0) rubbing.push_back(i);
  }
  const int count = int(rubbing.size());
  std::vector<double> matrix(size_t(count) * (count + 1));
  constexpr int MOST = 20;
  constexpr double SETTLED = 1e-13;  // of a friction force, that Newton's method no longer moves it
  bool settled = count == 0;
  for (int n = 0; n < MOST && !settled; n++) {
    for (int a = 0; a < count; a++) {
      const int i = rubbing[a];
      double margin = breaking_pull(m, i, t, m.foot_volts(i, t)) - out.pull[i];
      for (int k : rubbing) margin -= mode.feed[i * ni + feet + k] * out.friction[k];
      const Bound<double> bound = friction_bound(m, i, margin, m.laws.strength(i, t - m.feet[i].since), std::fabs(row(feet + i)));
      for (int b = 0; b < count; b++) {
        matrix[a * (count + 1) + b] = (a == b) - m.feet[i].sense * bound.by_margin * mode.feed[i * ni + feet + rubbing[b]];
      }
      matrix[a * (count + 1) + count] = -m.feet[i].sense * bound.most - out.friction[i];
    }
    if (!eliminate(matrix.data(), count, count + 1)) break;
    settled = true;
    for (int a = 0; a < count; a++) {
      const double change = matrix[a * (count + 1) + count];
      out.friction[rubbing[a]] += change;
      settled = settled && std::fabs(change) <= SETTLED * std::fabs(out.friction[rubbing[a]]) + m.settings.force_zero;
    }
  }
  for (int i : mode.held) {
    for (int k : rubbing) out.pull[i] += mode.feed[i * ni + feet + k] * out.friction[k];
  }
  for (int i : mode.stuck) {
    for (int k : rubbing) out.along[i] += mode.feed[(feet + i) * ni + feet + k] * out.friction[k];
  }
  return out;
}

// --- in an impact ----------------------------------------------------------------------------------------------------------

// Friction impulse [N s] along the ground on a foot that an impact throws back, and the kinetic energy [J] that it takes beyond
// what restitution takes.
template <class Real>
struct Braking {
  Real impulse, lost;
};

// Of all impulses that Coulomb's law allows, |p_t| <= ratio p_n, the one that leaves the least kinetic energy where the foot departs
// with the speed ``after``; w: how its rates, normal and along, answer impulses, with other feet held. It stops what the foot
// has along the ground when restitution begins, or brakes that as much as it may. So no impact ever adds energy, however
// the two ways are coupled; where they are not, the foot stops or is braked by ratio times the change of its normal rate.
template <class Real>
inline Braking<Real> braking(const Real& w_nn, const Real& w_nt, const Real& w_tt, const Real& speed, const Real& after,
                             const Real& along, const Real& ratio) {
  const Real slip = along + speed * w_nt / w_nn, mobility = w_tt - w_nt * w_nt / w_nn;
  Braking<Real> out{Real(0.0), Real(0.0)};
  if (slip == Real(0.0) || !(mobility > Real(0.0))) return out;
  const bool forward = slip > Real(0.0);
  out.impulse = -slip / mobility;
  const Real turned = forward ? -ratio : ratio, room = w_nn + turned * w_nt;  // p_t = turned p_n, p_n w_nn + p_t w_nt = speed + after
  if (room > Real(0.0)) {
    const Real most = turned * (speed + after) / room;
    if (forward ? out.impulse < most : most < out.impulse) out.impulse = most;
  }
  out.lost = -out.impulse * (slip + out.impulse * mobility * 0.5);
  return out;
}

}  // namespace tarsus::modal
