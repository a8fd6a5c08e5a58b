// What happens to a foot of a legged robot at the ground: impact, capture, release, slip and stick.
//
// A foot is a point mass between springs, so an impact changes its own velocity and nothing else: the
// mass-weighted map is exact, and feet that touch at the same moment do not know of each other.
#pragma once
#include "legged/scan.hpp"
#include "march/rules.hpp"

namespace tarsus::legged {

// Force of the structure on a foot held at ``u`` [N]: upward (its pull), or along the way.
inline double structure_force(const Legged& s, int i, int d, double u) {
  const Leg& leg = s.body.legs[i];
  double force = leg.stiffness[d] * (leg.hip[d].motion(s.x) - u) + leg.damping[d] * leg.hip[d].motion(s.v);
  if (d == UP) force -= leg.weight;
  for (int n = leg.first; n < leg.last; n++) {
    force += s.body.gain[2 * n + d] * s.player.value(s.body.drive[n], s.clock.time);
  }
  return force;
}

// Pull [N] on a foot on the ground, its smooth force there included.
inline double pull_on(const Legged& s, int i) {
  const Leg& leg = s.body.legs[i];
  double pull = structure_force(s, i, UP, -leg.gap);
  if (s.feet[i].force) pull += s.laws.force(leg.foot, 0.0, 0.0, s.volts_now(leg.foot), s.clock.time);
  return pull;
}

// Pull [N] on a foot on the ground that is none: of the scene's scale, or what rounding leaves of `pull_on`.
inline double no_pull(const Legged& s, int i) {
  const Leg& leg = s.body.legs[i];
  double parts = leg.stiffness[UP] * (leg.hip[UP].parts(s.x) + leg.gap) + leg.damping[UP] * leg.hip[UP].parts(s.v) + std::fabs(leg.weight);
  for (int n = leg.first; n < leg.last; n++) {
    parts += std::fabs(s.body.gain[2 * n + UP] * s.player.value(s.body.drive[n], s.clock.time));
  }
  if (s.feet[i].force) parts += std::fabs(s.laws.force(leg.foot, 0.0, 0.0, s.volts_now(leg.foot), s.clock.time));
  return s.settings.force_zero + ROUNDING * parts;
}

// Rate [m/s] of a foot at the ground that is none: of the scene's scale, or what rounding leaves of it beside its film's
// momentum, and of the gap in which that film takes speed.
inline double no_rate(const Legged& s, int i, double momentum) {
  const Leg& leg = s.body.legs[i];
  double parts = std::fabs(momentum);
  if (s.feet[i].film) parts += std::fabs(s.laws.momentum_slope(leg.foot, 0.0, s.settings.probe)) * leg.gap;
  return s.settings.speed_zero + ROUNDING * (std::fabs(s.feet[i].w[UP]) + parts / leg.mass);
}

// Momentum [N s] of the film under a foot at a gap, from that at its base on.
inline double momentum_at(const Legged& s, int i, double gap) {
  return s.feet[i].film ? s.film(i, gap) : 0.0;
}

// A flight or contact begins.
inline void begin_flight(Legged& s, int i, double rate) {
  LeggedFoot& foot = s.feet[i];
  foot.contact = AIR;
  foot.w[UP] = rate - momentum_at(s, i, 0.0) / s.body.legs[i].mass;
  foot.start = JUST_LEFT;
  foot.apex.restart(s.clock.time);
}

// Put a foot on the ground; what it has along the ground stays.
inline void begin_contact(Legged& s, int i) {
  LeggedFoot& foot = s.feet[i];
  foot.u[UP] = -s.body.legs[i].gap;
  foot.w[UP] = 0.0;
  foot.since = s.clock.time;
  foot.start = AS_IT_COMES;
  foot.apex.restart(s.clock.time);
  const bool rubs = s.laws.friction(s.body.legs[i].foot, 1.0, 1.0, 0.0) != 0.0;
  double& along = foot.w[ALONG];
  const bool stands = rubs && std::fabs(along) <= s.settings.speed_zero;
  if (stands) along = 0.0;
  foot.contact = stands ? STUCK : SLIPPING;
  foot.sense = !rubs || stands ? 0.0 : along > 0.0 ? 1.0 : -1.0;
}

// A foot is at the ground: bounce, capture, rest, or it lies there already.
inline void land(Legged& s, int i) {
  const Leg& leg = s.body.legs[i];
  LeggedFoot& foot = s.feet[i];
  const int f = leg.foot;
  const double t = s.clock.time;
  Landing<double> at = {};
  const double momentum = momentum_at(s, i, foot.u[UP] + leg.gap);
  at.speed = -(foot.w[UP] + momentum / leg.mass);
  foot.u[UP] = -leg.gap;
  at.pull = pull_on(s, i);
  at.strength = s.laws.strength(f, 0.0);
  at.mobility = 1.0 / leg.mass;
  at.none = no_pull(s, i) + ROUNDING * std::fabs(at.strength);
  if (at.speed <= no_rate(s, i, momentum)) {
    if (at.pull <= at.strength + at.none) {
      s.log.add(t, f, CONTACT_AT_START, foot.apex, 0.0, 0.0, at.pull, at.strength);
      begin_contact(s, i);
    } else {
      foot.w[UP] = std::max(-at.speed, 0.0) - momentum_at(s, i, 0.0) / leg.mass;
      foot.start = JUST_LEFT;
    }
    return;
  }
  at.after = s.laws.rebound(f, at.speed);
  if (s.laws.has(f, PULL_AS_PRINTED)) {
    const double own = structure_force(s, i, UP, -leg.gap);  // the ground's forces are no part of (2.13)
    at.printed = own - 2.0 * leg.stiffness[UP] * leg.gap + leg.damping[UP] * at.after;
  }
  const EventKind kind = landing_kind(s.laws, f, at, s.settings.rest_height);
  if (kind == BOUNCE) {
    const double lost = at.lost() + impact_friction(s.laws, f, leg.mass, at.speed + at.after, foot.w[ALONG]);
    s.log.add(t, f, BOUNCE, foot.apex, at.speed, at.after, at.pull, at.strength, lost);
    begin_flight(s, i, at.after);
    return;
  }
  const double over = kind == REST ? rest_time(t, at) : t;
  const double adhesion = s.laws.has(f, HAS_LATCH) && kind == CAPTURE ? at.kept() : 0.0;
  const double lost = at.lost() + at.kept() + impact_friction(s.laws, f, leg.mass, at.speed, foot.w[ALONG]);
  s.log.add(over, f, kind, foot.apex, at.speed, 0.0, at.pull, at.strength, lost, adhesion);
  begin_contact(s, i);
}

// Change the state of a foot by what happens to it at the present time.
inline void apply_event(Legged& s, int i, Happening kind) {
  if (kind == TOUCH) return land(s, i);
  LeggedFoot& foot = s.feet[i];
  const int f = s.body.legs[i].foot;
  const double t = s.clock.time, pull = pull_on(s, i), strength = s.laws.strength(f, t - foot.since);
  if (kind == PULL_OFF) {
    s.log.add(t, f, RELEASE, foot.apex, 0.0, 0.0, pull, strength);
    begin_flight(s, i, 0.0);
    return;
  }
  const double along = structure_force(s, i, ALONG, foot.u[ALONG]);
  const double bound = s.laws.friction(f, strength - pull, strength, 0.0);
  foot.w[ALONG] = 0.0;
  const bool sticks = kind == STOP && std::fabs(along) <= bound + s.settings.force_zero;
  s.log.add(t, f, sticks ? STICK_BEGINS : SLIP_BEGINS, foot.apex, 0.0, 0.0, along, bound);
  foot.contact = sticks ? STUCK : SLIPPING;
  foot.sense = sticks ? 0.0 : along > 0.0 ? 1.0 : -1.0;
  foot.start = sticks ? AS_IT_COMES : JUST_SLIDING;
}

}  // namespace tarsus::legged
