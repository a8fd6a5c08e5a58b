// The events of a foot of a legged robot at the ground: impact, capture, release, slip and stick.
//
// A foot is a point mass between springs, so an impact changes its own velocity and nothing else: the
// mass-weighted map is exact, and feet that touch at the same moment do not act on each other.
#pragma once
#include <utility>

#include "legged/scan.hpp"
#include "march/friction.hpp"

namespace tarsus::legged {

// Force [N] in direction d by which a slope couples its two directions, on a foot on the ground: 0 on level ground.
inline double coupling_force(const Legged& s, int i, int d) {
  const Leg& leg = s.body.legs[i];
  if (!leg.turned) return 0.0;
  const LeggedFoot& foot = s.feet[i];
  const double rate = d == UP ? foot.w[ALONG] : 0.0;
  return leg.cross_stiffness * (leg.hip[1 - d].motion(s.x) - foot.u[1 - d]) + leg.cross_damping * (leg.hip[1 - d].motion(s.v) - rate);
}

// Force of the structure on a foot held at ``u`` [N]: upward (its pull), or along the way.
inline double structure_force(const Legged& s, int i, int d, double u) {
  const Leg& leg = s.body.legs[i];
  double force = leg.stiffness[d] * (leg.hip[d].motion(s.x) - u) + leg.damping[d] * leg.hip[d].motion(s.v) - leg.weight[d];
  for (int n = leg.first; n < leg.last; n++) force += s.body.gain[s.directions() * n + d] * s.player.value(s.body.drive[n], s.clock.time);
  return force + coupling_force(s, i, d);
}

// Smooth force [N] of the laws on a foot at the ground without speed.
inline double force_at_rest(const Legged& s, int i) {
  const int f = s.body.legs[i].foot;
  return s.feet[i].force ? s.laws.force(f, 0.0, 0.0, s.volts_now(f), s.clock.time) : 0.0;
}

// Pull [N] on a foot on the ground, its smooth force there included.
inline double pull_on(const Legged& s, int i) { return structure_force(s, i, UP, -s.body.legs[i].gap) + force_at_rest(s, i); }

// Largest pull [N] that the contact of a foot holds now, and that one which begins now would.
inline double strength_now(const Legged& s, int i) {
  const int f = s.body.legs[i].foot;
  return s.laws.strength(f, s.clock.time - s.feet[i].since, s.volts_now(f));
}
inline double new_strength(const Legged& s, int i) {
  const int f = s.body.legs[i].foot;
  return s.laws.strength(f, s.feet[i].brought(s.laws, f, s.clock.time), s.volts_now(f));
}

// What friction has to bear along the ground under a foot that sticks, and can, of a contact of that strength [N]; of one that may slide any
// way, how much it is in all.
inline Bearing bearing_of(const Legged& s, int i, double strength) {
  const LeggedFoot& foot = s.feet[i];
  double along = structure_force(s, i, ALONG, foot.u[ALONG]);
  if (s.directions() > DIRECTIONS) along = std::hypot(along, structure_force(s, i, ACROSS, foot.u[ACROSS]));
  return {s.laws, s.body.legs[i].foot, strength - pull_on(s, i), strength, along};
}

// Momentum [N s] of the film under a foot in the air at a gap, from its base on.
inline double film_above(const Legged& s, int i, double gap) { return s.feet[i].film && !s.body.legs[i].turned ? s.film(i, gap) : 0.0; }

// Rate [m/s] without the film's momentum of a foot that leaves the ground at a rate.
inline double leaving_rate(const Legged& s, int i, double rate) { return rate - film_above(s, i, 0.0) / s.body.legs[i].mass; }

// A foot reaches the ground: its gap becomes zero. Returns the state before the impact, all but `Landing::after`, `printed` and
// `none`.
inline Landing pre_impact(Legged& s, int i) {
  const Leg& leg = s.body.legs[i];
  LeggedFoot& foot = s.feet[i];
  const double speed = -(foot.w[UP] + film_above(s, i, s.gap_now(i)) / leg.mass);
  foot.u[UP] = leg.standing();
  return {speed, 0.0, pull_on(s, i), new_strength(s, i), 0.0, 1.0 / leg.mass, 0.0};
}

// The state after the impact of a foot that approaches: the speed of departure.
inline void post_impact(const Legged& s, int i, Landing& at) {
  const Leg& leg = s.body.legs[i];
  at.after = s.laws.rebound(leg.foot, at.speed);
  if (!s.laws.has(leg.foot, PULL_AS_PRINTED)) return;
  const double own = structure_force(s, i, UP, leg.standing());  // the ground's forces are no part of (2.13)
  at.printed = own - 2.0 * leg.stiffness[UP] * leg.gap + leg.damping[UP] * at.after;
}

// Its velocity after the impact. Returns the energy [J] that the impact takes.
inline double impact(Legged& s, int i, EventKind kind, const Landing& at) {
  LeggedFoot& foot = s.feet[i];
  const bool bounces = kind == BOUNCE, any_way = s.directions() > DIRECTIONS;
  const double restituted = bounces ? at.lost() : at.lost() + at.kept();
  foot.w[UP] = bounces ? leaving_rate(s, i, at.after) : 0.0;
  const double slip = any_way ? std::hypot(foot.w[ALONG], foot.w[ACROSS]) : foot.w[ALONG];
  const Braking out = impact_friction(s.laws, s.body.legs[i].foot, {at.mobility, 0.0, at.mobility}, at.speed, bounces ? at.after : 0.0, slip);
  if (!any_way) foot.w[ALONG] = out.left;
  if (any_way && slip > 0.0) {  // against the slip, along and across alike: it keeps its direction
    for (int d : {ALONG, ACROSS}) foot.w[d] *= out.left / slip;
  }
  return restituted + out.lost;
}

// Bound [m/s] below which the rate of a foot at the ground counts as zero: by the scale of the scene, or the rounding of the
// rate, of its film's momentum, and of the gap in which that film takes speed.
inline double no_rate(const Legged& s, int i, double momentum) {
  const Leg& leg = s.body.legs[i];
  double parts = std::fabs(momentum);
  if (s.feet[i].film) parts += std::fabs(s.laws.momentum_slope(leg.foot, 0.0, s.settings.probe)) * std::fabs(leg.standing());
  return s.settings.speed_zero + ROUNDING * (std::fabs(s.feet[i].w[UP]) + parts / leg.mass);
}

// A flight or contact begins.
inline void begin_flight(Legged& s, int i) {
  LeggedFoot& foot = s.feet[i];
  foot.contact = AIR;
  foot.start = JUST_LEFT;
  foot.apex.restart(s.clock.time);
}

// Put a foot on the ground; its motion along the ground is unchanged.
inline void begin_contact(Legged& s, int i) {
  LeggedFoot& foot = s.feet[i];
  foot.u[UP] = s.body.legs[i].standing();
  foot.w[UP] = 0.0;
  foot.begin(s.laws, s.body.legs[i].foot, s.clock.time);
  foot.start = AS_IT_COMES;
  foot.apex.restart(s.clock.time);
  const bool any_way = s.directions() > DIRECTIONS;
  const double along = foot.w[ALONG], across = any_way ? foot.w[ACROSS] : 0.0, slip = any_way ? std::hypot(along, across) : along;
  const Footing on(s.laws.has_friction_at(s.body.legs[i].foot, std::fabs(slip)), slip, s.settings.speed_zero);
  if (on.sticks) foot.w[ALONG] = foot.w[ACROSS] = 0.0;
  const bool turned = any_way && on.sense != 0.0;
  foot.set_sliding(!on.sticks, turned ? along / slip : on.sense, turned ? across / slip : 0.0, false);
}

// A foot reaches the ground: it bounces, is captured, comes to rest, or has no speed and lies there already. pull [N]: on it where
// it is not held by this facet alone.
inline void land(Legged& s, int i, const double* pull = nullptr) {
  LeggedFoot& foot = s.feet[i];
  const int f = s.body.legs[i].foot;
  const double t = s.clock.time;
  const double momentum = film_above(s, i, s.gap_now(i));
  Landing at = pre_impact(s, i);
  if (pull != nullptr) at.pull = *pull;
  at.none = no_pull(s, i) + ROUNDING * std::fabs(at.strength);
  if (at.speed <= no_rate(s, i, momentum)) {
    if (at.pull <= at.strength + at.none) {
      s.log.add(t, f, CONTACT_AT_START, foot.apex, 0.0, 0.0, at.pull, at.strength);
      begin_contact(s, i);
    } else {
      foot.w[UP] = leaving_rate(s, i, std::max(-at.speed, 0.0));
      foot.start = JUST_LEFT;
    }
    return;
  }
  post_impact(s, i, at);
  const EventKind kind = landing_kind(s.laws, f, at, s.settings.rest_height);
  s.log.add(f, kind, foot.apex, numbers_of(s.laws, f, kind, t, at, impact(s, i, kind, at)));
  if (kind == BOUNCE) return begin_flight(s, i);
  begin_contact(s, i);
}

// ---- on uneven ground

// A foot reaches its facet.
inline void land_on_facet(Legged& s, int i, const double* pull = nullptr) {
  turn(s, i);
  land(s, i, pull);
  if (s.feet[i].contact == AIR) turn_back(s, i);
}

// A foot in contact is in the air from now on, above the facet on that side where it is vertical.
inline void leave_facet(Legged& s, int i, const Facet& above) {
  begin_flight(s, i);
  turn_back(s, i);
  pass_over(s, i, above);
}
inline Facet open_side(const Legged& s, int i) {
  const Facet& on = s.feet[i].ground;
  return on.upright() ? profile_of(s, i).facet(on.number + (on.sin > 0.0 ? -1 : 1)) : on;
}

// What is noted of a foot that leaves a facet for the next one, or for the air beyond it.
inline void end_contact(Legged& s, int i) {
  LeggedFoot& foot = s.feet[i];
  const int f = s.body.legs[i].foot;
  const double t = s.clock.time;
  s.log.add(t, f, RELEASE, foot.apex, 0.0, 0.0, pull_on(s, i), strength_now(s, i));
  foot.end(t);
  foot.wedged = 0;
}

// A foot at rest lies on the next facet as well.
inline void lie_on(Legged& s, int i, const Facet& next) {
  LeggedFoot& foot = s.feet[i];
  end_contact(s, i);
  turn_back(s, i);
  foot.contact = AIR;  // for a moment, so that the facet's frame is entered from the air
  pass_over(s, i, next);
  turn(s, i);
  const int f = s.body.legs[i].foot;
  foot.u[UP] = s.body.legs[i].standing();
  s.log.add(s.clock.time, f, CONTACT_AT_START, foot.apex, 0.0, 0.0, pull_on(s, i), new_strength(s, i));
  begin_contact(s, i);
}

// What the two facets of a corner bear of a foot there without friction, R = N n + N' n' [N]: its own with the strength of the contact,
// N + f_a, and the next one N'.
struct Pressing {
  double own, next;

  Pressing(const Bearing& at, const Corner& corner, int way) : next(double(way) * at.along / corner.sin) { own = at.margin - next * corner.cos; }
  bool holds() const { return next > 0.0 && own >= 0.0; }
};

// What drives a foot that stands still on a ridge towards it, on its own facet and back from the next one [N]. Where both do, the structure pulls
// the foot off the ground between the two normals, and what attracts it to either facet holds it: on neither it could stay, and so it
// stands on the ridge.
struct OnRidge {
  double own, back;

  // breaking [N]: the pull that breaks the contact.
  OnRidge(const Bearing& at, double breaking, const Corner& corner, int way)
      : own(way * at.along), back(-(breaking - at.margin) * corner.sin - own * corner.cos) {}
  bool holds() const { return own > 0.0 && back >= 0.0; }
};

// A foot stands still in a corner at an end of its facet. In a concave one, pressed against both it is held; away from the next one, or pulled off its own (``shifts``), it is on one
// facet, where it sticks or slides out of the corner. On a ridge it is held where both facets drive it there.
inline void stand_in_corner(Legged& s, int i, int way, bool shifts) {
  LeggedFoot& foot = s.feet[i];
  const Corner corner = corner_of(s, i, way);
  const int f = s.body.legs[i].foot;
  foot.w[UP] = foot.w[ALONG] = 0.0;
  foot.wedged = 0;
  const double strength = strength_now(s, i);
  Bearing at = bearing_of(s, i, strength);
  const Pressing by(at, corner, way);
  const OnRidge ridge(at, strength - force_at_rest(s, i), corner, way);
  if ((corner.rises() ? by.holds() : ridge.holds()) && !shifts) {
    foot.set_sliding(false, 0.0, 0.0, false);
    foot.wedged = way;
    s.log.add(s.clock.time, f, STICK_BEGINS, foot.apex, 0.0, 0.0, at.along, at.most);
    return;
  }
  if (corner.rises() ? by.next > 0.0 : ridge.own > 0.0) {
    lie_on(s, i, profile_of(s, i).facet(foot.ground.number + way));
    way = -way;
    at = bearing_of(s, i, strength_now(s, i));
  }
  const bool had = foot.contact == STUCK, friction = s.laws.has_friction_at(f), sticks = friction && at.holds(s.settings.force_zero);
  foot.set_sliding(!sticks, sticks || !friction ? 0.0 : double(-way), 0.0, !sticks);
  if (had != sticks) s.log.add(s.clock.time, f, sticks ? STICK_BEGINS : SLIP_BEGINS, foot.apex, 0.0, 0.0, at.along, at.most);
}

// Whether a foot that slides comes to stand on the ridge at an end of its facet: both facets drive it there, and it would come no farther
// beyond than flights are high that are none. Of facets that are not alike neither is asked for the other.
inline bool stops_on_ridge(Legged& s, int i, const Corner& corner, int way) {
  if (s.body.patched || profile_of(s, i).facet(s.feet[i].ground.number + way).upright()) return false;
  const double along = std::exchange(s.feet[i].w[ALONG], 0.0);
  const double strength = strength_now(s, i);
  const OnRidge ridge(bearing_of(s, i, strength), strength - force_at_rest(s, i), corner, way);
  s.feet[i].w[ALONG] = along;
  return ridge.holds() && 0.5 * s.body.legs[i].mass * along * along < s.settings.rest_height * std::min(ridge.own, ridge.back);
}

// A foot that slides comes to an end of its facet. Where the ground falls away it flies off as it moves: no finite strength turns it. Where
// the ground rises it lands on the next facet, by an impact of its own like any other.
inline void turn_corner(Legged& s, int i, int way) {
  LeggedFoot& foot = s.feet[i];
  const Corner corner = corner_of(s, i, way);
  const Facet old = foot.ground, next = profile_of(s, i).facet(old.number + way);
  const bool ridge = !corner.rises() && !corner.straight(), stops = ridge && stops_on_ridge(s, i, corner, way);
  if (corner.rises() || stops) foot.u[ALONG] = old.end(way) - s.body.legs[i].place;
  const double speed = way * foot.w[ALONG] * corner.sin;
  const bool meets = corner.rises() && !corner.straight();
  const Pressing by(bearing_of(s, i, strength_now(s, i)), corner, way);
  const double energy = 0.5 * s.body.legs[i].mass * foot.w[ALONG] * foot.w[ALONG];
  // no more swings from one facet to the other than flights that are as low
  const bool low = by.holds() && energy < s.settings.rest_height * std::min(by.own, by.next);
  if (stops || (meets && (low || speed <= no_rate(s, i, 0.0)))) {
    const size_t before = s.log.events.size();
    stand_in_corner(s, i, way, false);
    if (s.log.events.size() > before) s.log.events[before].energy += energy;
    return;
  }
  const double pull = -by.next;
  end_contact(s, i);
  if (ridge) {
    leave_facet(s, i, next.upright() ? profile_of(s, i).facet(next.number + way) : next);
    return;
  }
  turn_back(s, i);
  foot.contact = AIR;
  pass_over(s, i, next);
  land_on_facet(s, i, meets && by.holds() ? &pull : nullptr);
  if (foot.contact == AIR) {
    const bool returns = !old.upright() && (next.upright() || way * foot.w[ALONG] < 0.0);
    pass_over(s, i, returns ? old : next);
    if (returns) foot.start = AS_IT_COMES;
    return;
  }
  if (corner.straight() || way * foot.w[ALONG] > s.settings.speed_zero) return;
  // what is left of its motion would take it back into the corner: both facets stop it
  s.log.events.back().energy += 0.5 * s.body.legs[i].mass * foot.w[ALONG] * foot.w[ALONG];
  stand_in_corner(s, i, -way, false);
}

// A foot in the air comes above an end of its facet: it passes, or hits the side of a step.
inline void pass_corner(Legged& s, int i, int way) {
  LeggedFoot& foot = s.feet[i];
  s.rebase(i);
  foot.u[ALONG] = end_of(s, i, way) - s.body.legs[i].place;
  const Facet next = profile_of(s, i).facet(foot.ground.number + way);
  foot.start = AS_IT_COMES;
  if (!next.upright()) return pass_over(s, i, next);
  const Facet beyond = profile_of(s, i).facet(next.number + way);
  const double height = foot.u[UP] + s.level[i].gap;
  if (height >= beyond.height(-way) - beyond.rounding()) return pass_over(s, i, beyond);
  const Facet before = foot.ground;
  pass_over(s, i, next);
  land_on_facet(s, i);
  if (foot.contact != AIR) return;
  pass_over(s, i, before);
  foot.start = JUST_LEFT;
}

// A foot that may slide any way begins to slide, or its speed passes zero. Where friction holds it then, it stops, for its speed only
// falls: what its step leaves of the velocity goes to friction. Elsewhere it slides on towards what drives it if what is left moves it by
// less in such a step than the repetition leaves open; any other velocity only passes by zero, and friction turns to it.
inline void turn_slip(Legged& s, int i, FootEvent kind, const Bearing& at) {
  LeggedFoot& foot = s.feet[i];
  const double speed = std::hypot(foot.w[ALONG], foot.w[ACROSS]), energy = 0.5 * s.body.legs[i].mass * speed * speed;
  const bool sticks = kind == STOP && at.holds(s.settings.force_zero), still = kind != STOP || speed * s.length <= CONVERGED * s.settings.gap;
  if (!still && !sticks) return foot.set_sliding(true, foot.w[ALONG] / speed, foot.w[ACROSS] / speed, false);
  if (foot.supposed != s.clock.time) s.log.add(s.clock.time, s.body.legs[i].foot, sticks ? STICK_BEGINS : SLIP_BEGINS, foot.apex, 0.0, 0.0, at.along, at.most);
  s.energy.friction += energy;
  foot.w[ALONG] = foot.w[ACROSS] = 0.0;
  if (sticks) return foot.set_sliding(false, 0.0, 0.0, false);
  const double size = at.along > 0.0 ? at.along : 1.0;
  foot.set_sliding(true, structure_force(s, i, ALONG, foot.u[ALONG]) / size, structure_force(s, i, ACROSS, foot.u[ACROSS]) / size, true);
}

// Change the state of a foot by its event at the present time.
inline void apply_event(Legged& s, int i, FootEvent kind) {
  if (kind == TOUCH) return land_on_facet(s, i);
  LeggedFoot& foot = s.feet[i];
  if (kind == HIGH_END || kind == LOW_END) {
    const int way = kind == HIGH_END ? 1 : -1;
    return foot.contact == AIR ? pass_corner(s, i, way) : turn_corner(s, i, way);
  }
  if (kind == SHIFT || kind == LOOSE) return stand_in_corner(s, i, foot.wedged, kind == SHIFT);

  const int f = s.body.legs[i].foot;
  const double t = s.clock.time, pull = pull_on(s, i), strength = strength_now(s, i);
  if (kind == PULL_OFF) {
    s.log.add(t, f, RELEASE, foot.apex, 0.0, 0.0, pull, strength);
    foot.end(t);
    foot.wedged = 0;
    foot.w[UP] = leaving_rate(s, i, 0.0);
    if (s.body.legs[i].turned) return leave_facet(s, i, open_side(s, i));
    begin_flight(s, i);
    return;
  }
  const Bearing at = bearing_of(s, i, strength);
  if (s.profile != nullptr) {
    const int way = int(sense_of_slip(at.along));
    const Leg& leg = s.body.legs[i];
    const double left = std::fabs(foot.ground.end(way) - foot.u[ALONG] - leg.place);
    if (left <= leg.rounding && corner_of(s, i, way).rises()) return stand_in_corner(s, i, way, false);
  }
  if (s.directions() > DIRECTIONS) return turn_slip(s, i, kind, at);
  foot.w[ALONG] = 0.0;
  const bool sticks = kind == STOP && at.holds(s.settings.force_zero);
  if (foot.supposed != t) s.log.add(t, f, sticks ? STICK_BEGINS : SLIP_BEGINS, foot.apex, 0.0, 0.0, at.along, at.most);
  foot.set_sliding(!sticks, sticks ? 0.0 : sense_of_slip(at.along), 0.0, !sticks);
}

}  // namespace tarsus::legged
