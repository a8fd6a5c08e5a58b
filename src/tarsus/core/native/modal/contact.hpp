// The events of one foot at the ground, an impact and what it breaks; and changing from one contact mode to another.
#pragma once
#include "modal/friction.hpp"

namespace tarsus::modal {

// Gaps [m] of the free feet; the flowing state becomes the modal one: w + sum beta_i P_i.
inline void add_film_momenta(Modal& m) {
  for (int i = 0; i < m.sizes.feet; i++) m.gaps[i] = m.mode->is_held[i] ? 0.0 : m.gap_of(i);
  for (int i : m.mode->free) {
    if (m.laws.has(i, HAS_MOMENTUM)) m.shift(m.mode->beta, i, m.film(i, m.gaps[i]));
  }
}

// And back, at the gaps found by add_film_momenta.
inline void remove_film_momenta(Modal& m) {
  for (int i : m.mode->free) {
    if (!m.laws.has(i, HAS_MOMENTUM)) continue;
    const double momentum = m.film(i, m.gaps[i]);
    m.feet[i].momentum = momentum;
    m.shift(m.mode->beta, i, -momentum);
  }
  m.ended = NOT_A_NUMBER;
}

// Displacements and velocities of the modal state, and that of a contact mode that they are projected on (mass-weighted: new
// contacts are plastic).
inline void find_physical(Modal& m) {
  const int n = m.sizes.coordinates;
  for (int r = 0; r < 2 * n; r++) m.physical[r] = m.bias->offset[r] + m.along(m.mode->to_physical, r);
  for (int i : m.mode->stuck) {
    for (int r = 0; r < n; r++) m.physical[r] = m.physical[r] + m.mode->placed[size_t(i) * n + r] * m.feet[i].place;
  }
}
inline void project(Modal& m) {
  const int n = m.sizes.coordinates, n2 = 2 * n;
  for (int r = 0; r < n2; r++) m.from_offset[r] = m.physical[r] - m.bias->offset[r];
  for (int i : m.mode->stuck) {
    for (int r = 0; r < n; r++) m.from_offset[r] = m.from_offset[r] - m.mode->placed[size_t(i) * n + r] * m.feet[i].place;
  }
  for (int r = 0; r < m.sizes.state(); r++) {
    double sum = 0.0;
    for (int c = 0; c < n2; c++) sum = sum + m.mode->from_physical[size_t(r) * n2 + c] * m.from_offset[c];
    m.state()[r] = sum;
  }
  for (int i = 0; i < m.sizes.feet; i++) m.gaps[i] = m.mode->is_held[i] ? 0.0 : m.gap_of(i);
}

// The result of ``ask`` for the modal state projected on another contact mode.
template <class Ask>
inline double in_mode(Modal& m, const ContactMode& other, Ask&& ask) {
  const ContactMode& here = *m.mode;
  const std::vector<double> state(m.state(), m.state() + m.sizes.state()), gaps = m.gaps;
  find_physical(m);
  m.set_mode(other);
  project(m);
  const double out = ask();
  m.set_mode(here);
  std::copy(state.begin(), state.end(), m.state());
  m.gaps = gaps;
  return out;
}

// Pull on a foot in another contact mode, smooth force at contact included.
inline double pull_in(Modal& m, const ContactMode& mode, int foot) {
  const double pull = in_mode(m, mode, [&] { return moment_of(m).pull[foot]; });
  return m.laws.has(foot, HAS_FORCE) ? pull + m.force_now(foot, 0.0, 0.0) : pull;
}

// `pull_if_held` where feet slide or stick, of a foot that has no sense of sliding: friction at the others goes by the pulls on
// them once the foot is held. Its own friction does not count: whether a foot is held does not depend on a force that its
// contact bears.
inline double pull_without_own_friction(Modal& m, int foot) {
  return pull_in(m, m.book.with_foot(*m.mode, foot, true, false), foot);
}

// Structure's pull on a free foot if it were stopped on the ground now, smooth force at contact included. Film forces at the
// other feet are those at their rates after it is stopped.
inline double pull_if_held(Modal& m, int foot) {
  if (m.sizes.ways > 0) return pull_without_own_friction(m, foot);
  const double stop = -m.rate_of(foot);
  double pull = robot_pull(m, m.mode->held_rows, m.mode->held_feed, m.bias->held[foot], foot);
  if (m.laws.has(foot, HAS_FORCE)) pull = pull + m.force_now(foot, 0.0, 0.0);
  for (int k : m.mode->free) {
    const double factor = m.mode->held_feed[size_t(foot) * m.sizes.inputs() + m.sizes.feet + k];
    if (factor == 0.0 || k == foot) continue;
    const double rate = m.rate_of(k) + stop * m.mode->rate_by_jump(foot, k);
    if (m.laws.has(k, HAS_MOMENTUM)) pull = pull + factor * rate * m.laws.momentum_slope(k, m.gaps[k], m.settings.probe);
    if (m.laws.has(k, HAS_FORCE)) pull = pull + factor * m.force_now(k, m.gaps[k], rate);
  }
  return pull;
}

inline double new_strength(const Modal& m, int foot) {
  return m.laws.has(foot, HAS_LATCH) ? m.laws.strength(foot, m.age_brought(foot), m.volts_now(foot)) : 0.0;
}

// How the structure follows an impact beyond the mass-weighted map: the velocity b across the normal becomes
// alpha b + beta a, a = speed / sqrt(mobility). As it is: alpha = 1, beta = (1 + e) skew; or the passive projection of
// that, see tarsus.model.laws.impact_map.
struct FollowedBy {
  double alpha, beta;

  FollowedBy(double e, double skew, bool as_is) : alpha(1.0), beta((1.0 + e) * skew) {
    if (as_is) return;
    const double theta = passive_angle(e, skew);
    alpha = std::cos(theta);
    beta = std::sqrt(std::max(1.0 - e * e, 0.0)) * std::sin(theta);
  }
};

// Returns the kinetic energy [J] that this takes.
inline double follow_impact(Modal& m, int foot, const Landing& at) {
  const double skew = m.mode->skew[foot];
  if (skew == 0.0 || at.speed == 0.0) return 0.0;
  const FollowedBy by(at.after / at.speed, skew, m.laws.has(foot, MAP_AS_IS));
  const double before = m.along(m.mode->side_rate, foot);
  const double then = by.alpha * before + by.beta * at.speed / std::sqrt(at.mobility);
  m.shift(m.mode->side, foot, then - before);
  return 0.5 * (before * before - then * then);
}

// A foot at the ground that approaches it; the state is the modal one, and its gap 0. All but `Landing::none`.
inline Landing landing_of(Modal& m, int foot) {
  const double rate = m.rate_of(foot);
  Landing at{-rate, m.laws.rebound(foot, -rate), pull_if_held(m, foot), new_strength(m, foot), 0.0, m.mode->mobility[foot], 0.0};
  if (m.laws.has(foot, PULL_AS_PRINTED)) {
    at.printed = robot_pull(m, m.mode->printed, m.mode->printed_feed, m.bias->printed[foot], foot) +
                 m.mode->printed_damping[foot] * (rate + at.after);
  }
  return at;
}

// Its velocities after the impact, and what braked it along the ground; the energy [J] is all that the impact takes. A foot that
// does not bounce is only braked: the contact mode stops it.
inline Braking follow_landing(Modal& m, int foot, EventKind kind, const Landing& at) {
  const bool bounces = kind == BOUNCE;
  Braking out = braking_of(m, foot, at.speed, bounces ? at.after : 0.0);
  out.lost = (bounces ? at.lost() + follow_impact(m, foot, at) : at.lost() + at.kept()) + out.lost;
  if (bounces) m.shift(m.mode->jump, foot, at.after + at.speed);
  brake(m, foot, out.impulse);
  return out;
}

// ---- decisions, and the events that are logged

// Sum of the sizes [N] of the terms of `pull_if_held` of a free foot at the ground: its dampers and films multiply rates that are
// known to rounding.
inline double pull_parts(const Modal& m, int foot, double t) {
  const double* feed = m.mode->held_feed + foot * m.sizes.inputs();
  double parts = m.parts(m.mode->held_rows, foot) + std::fabs(m.bias->held[foot]);
  for (int d = 0; d < m.sizes.drives; d++) {
    if (feed[2 * m.sizes.feet + d] != 0.0) parts += std::fabs(feed[2 * m.sizes.feet + d] * m.player.value(d, t));
  }
  if (m.laws.has(foot, HAS_FORCE)) parts += std::fabs(m.laws.force(foot, 0.0, 0.0, m.foot_volts(foot, t), t));
  for (int k : m.mode->free) {
    const double factor = std::fabs(feed[m.sizes.feet + k]);
    if (factor == 0.0 || k == foot) continue;
    const double speeds = std::max(m.feet[k].speeds, m.rate_parts(k));
    if (m.laws.has(k, HAS_MOMENTUM)) parts += factor * speeds * std::fabs(m.laws.momentum_slope(k, m.gaps[k], m.settings.probe));
    if (m.laws.has(k, HAS_FORCE)) parts += factor * std::fabs(m.laws.force(k, m.gaps[k], m.rate_of(k), m.foot_volts(k, t), t));
  }
  return parts;
}

// Bound [N] below which that pull counts as zero: by the scale of the scene, or its rounding.
inline double no_pull(const Modal& m, int foot, double t) { return m.settings.force_zero + ROUNDING * pull_parts(m, foot, t); }

// Leave the present contact mode for another: keep the physical state for ``enter_mode``.
inline void leave_mode(Modal& m, const ContactMode& to) {
  find_physical(m);
  for (int i : to.stuck) {
    if (!m.mode->is_stuck[i]) m.feet[i].place = m.book.place_along(i, m.physical);
  }
  m.next = &to;
  m.entering = true;
}

// For the one in which a foot is held, along the ground too where it sticks, or released.
inline void leave_mode(Modal& m, int foot, bool held, bool sticks = false) {
  leave_mode(m, m.book.with_foot(*m.mode, foot, held, sticks));
}

// The smooth inputs that sweeps go through: those that act, or where feet follow others, of the leading feet all of a kind that
// acts anywhere.
inline void find_pushing(Modal& m) {
  const ContactMode& mode = *m.mode;
  m.rated = false;
  for (int i : mode.free) m.rated = m.rated || m.laws.has(i, USES_RATE);
  m.pushing = m.acting;
  if (!mode.shares()) return;
  m.pushing.clear();
  for (int first : {0, m.sizes.feet}) {
    const bool any = std::any_of(m.acting.begin(), m.acting.end(), [&](int i) { return (i < m.sizes.feet) == (first == 0); });
    for (int i : mode.leading) {
      if (any) m.pushing.push_back(first + i);
    }
  }
}

// All inputs that act: friction on feet that slide, and the places of those that stick, too.
inline void add_along(Modal& m) {
  const ContactMode& mode = *m.mode;
  m.inputs = m.acting;
  m.braked.clear();
  for (int i = 0; i < m.sizes.ways; i++) {
    m.constant[m.sizes.feet + i] = mode.is_stuck[i];
    m.values[m.sizes.feet + i] = Row(mode.is_stuck[i] ? m.feet[i].place : 0.0);
  }
  for (int i : mode.sliding) {
    if (m.feet[i].sense == 0.0) continue;
    m.braked.push_back(i);
    m.inputs.push_back(m.sizes.feet + i);
  }
  for (int i : mode.stuck) m.inputs.push_back(m.sizes.feet + i);
}

// Enter the contact mode ``next`` with the physical state.
inline void enter_mode(Modal& m) {
  m.set_mode(*m.next);
  m.entering = false;
  m.film_now = NOT_A_NUMBER;
  const ContactMode& mode = *m.mode;
  project(m);
  if (m.strong) m.rebase();
  remove_film_momenta(m);
  m.acting.clear();
  for (int i : mode.free) {
    if (m.laws.has(i, HAS_MOMENTUM)) m.acting.push_back(i);
  }
  for (int i : mode.free) {
    if (m.laws.has(i, HAS_FORCE)) m.acting.push_back(m.sizes.feet + i);
  }
  find_pushing(m);
  for (int i = 2 * m.sizes.feet; i < m.sizes.last(); i++) m.acting.push_back(i);
  add_along(m);
}

// A foot comes to the ground or leaves it; its flight or contact ends here.
inline void turn_over(Modal& m, int foot, int departure, double t) {
  m.feet[foot].departure = departure;
  m.feet[foot].rose = t;
  m.feet[foot].apex.restart(t);
}

// Whether a foot put on the ground sticks there: once stopped it has nothing along the ground. If not, it slides in the
// direction in which it moves.
inline bool sticks_at_once(Modal& m, int foot) {
  if (!m.frictional[foot]) return false;
  const Mobilities by = mobilities_of(m, foot);
  double rate = m.along(m.mode->slide_rate, foot);
  if (by.normal > 0.0) rate -= by.across / by.normal * m.rate_of(foot);
  const Footing on(true, rate, no_slide(m, foot));
  m.feet[foot].sense = on.sense;
  m.feet[foot].slide = UNDER_WAY;
  return on.sticks;
}

// Put a foot on the ground; the state is the modal one. Returns whether it sticks there.
inline bool put_down(Modal& m, int foot, double t) {
  m.feet[foot].begin(m.laws, foot, t);
  turn_over(m, foot, UNDER_WAY, t);
  return sticks_at_once(m, foot);
}
inline void hold(Modal& m, int foot, double t) { leave_mode(m, foot, true, put_down(m, foot, t)); }

// Share of an impulse below which a part of it counts as zero: some thousand times the rounding of the sums it is made of.
constexpr double NO_IMPULSE = 1e-12;

// Impulses [N s] on a foot that lands, along the normal and along the ground.
struct Blow {
  int foot;
  double normal, along;
};

// A constraint that impulses break: a foot is pulled off, or one that sticks (feet + foot) slides in the direction ``sense``.
struct Broken {
  int constraint;
  double sense;
};

// All that an impact with these impulses breaks: a foot pulled off, for no finite adhesion carries an impulse; or
// one that sticks and takes a larger impulse along the ground than friction holds under its share of the normal
// one; it then slides in that direction. An impact on other feet takes nothing along the ground from feet that slide already.
inline std::vector<Broken> broken_by(const Modal& m, const std::vector<Blow>& blows) {
  const int feet = m.sizes.feet, ni = m.sizes.inputs();
  double none = 0.0;
  for (const Blow& blow : blows) none += NO_IMPULSE * (blow.normal + std::fabs(blow.along));
  const auto carried = [&](int c) {
    double sum = 0.0;
    for (const Blow& blow : blows) {
      sum += -m.mode->feed[c * ni + feet + blow.foot] * blow.normal;
      if (m.sizes.ways > 0) sum -= m.mode->slide_feed[c * m.sizes.ways + blow.foot] * blow.along;
    }
    return sum;
  };
  std::vector<Broken> out;
  for (int k : m.mode->held) {
    if (carried(k) < -none) out.push_back({k, 0.0});
  }
  for (int k : m.mode->stuck) {
    const double push = carried(k), needed = carried(feet + k);
    if (push < -none || std::fabs(needed) <= m.laws.friction(k, std::max(push, 0.0), 0.0, 0.0) + none) continue;
    out.push_back({feet + k, -sense_of_slip(needed)});
  }
  return out;
}

// Whether a foot could not rise as high as a flight that counts after its impact. The impacts of a rocking body go from foot to foot and become
// ever smaller: such an impact releases none.
inline bool too_low_to_detach(const Modal& m, const Landing& at) {
  return at.pull < 0.0 && at.speed * at.speed < -2.0 * at.pull * at.mobility * m.settings.rest_height;
}

// The first constraint that this impact of one foot breaks, or none: no finite adhesion carries an impulse.
inline std::vector<Broken> broken_by_impact(Modal& m, int foot, const Landing& at) {
  if (too_low_to_detach(m, at)) return {};
  if (m.sizes.ways > 0) {
    const double along = braking_of(m, foot, at.speed, at.after).impulse;
    std::vector<Broken> out = broken_by(m, {{foot, (at.speed + at.after - mobilities_of(m, foot).across * along) / at.mobility, along}});
    if (out.size() > 1) out.resize(1);
    return out;
  }
  for (int k : m.mode->held) {
    if (m.mode->reaction[foot * m.sizes.feet + k] < -NO_IMPULSE) return {{k, 0.0}};
  }
  return {};
}

// Feet are detached by an impact on others, or slide where they stuck.
inline void release_by_impact(Modal& m, const std::vector<Broken>& broken) {
  FootSet left = m.mode->feet;
  for (const Broken& one : broken) {
    const int foot = one.constraint % m.sizes.feet;
    const bool leaves = one.constraint < m.sizes.feet;
    m.log.add(m.clock.time, foot, leaves ? RELEASE : SLIP_BEGINS, m.feet[foot].apex);
    (leaves ? m.feet[foot].departure : m.feet[foot].slide) = FROM_REST;
    m.feet[foot].sense = one.sense;
    if (leaves) m.feet[foot].end(m.clock.time);
    left.set(foot, !leaves);
    if (m.sizes.ways > 0) left.set(m.sizes.feet + foot, false);
  }
  leave_mode(m, m.book.require(left));
}

// Count consecutive flights that are too short to count and lower than the error of a step. An impact moves feet under strong
// films, whose forces detach the impacted one again for as long as they relax; then it lands again, up to millions of times.
inline void count_low(Modal& m, int foot, double speed, double t) {
  Foot& f = m.feet[foot];
  constexpr double HIDDEN = 0.1, SHORT = 1e-5;  // parts of the error of a step, and of a run
  const double hidden = HIDDEN * m.units.gap * m.settings.widest;
  const bool low = t - f.rose < SHORT * m.settings.end && speed * (t - f.rose) < hidden;
  f.low = low ? f.low + 1 : 0;
}

}  // namespace tarsus::modal
