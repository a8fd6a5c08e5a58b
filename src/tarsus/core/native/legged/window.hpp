// A legged robot's run from any moment on.
#pragma once
#include "legged/march.hpp"
#include "march/window.hpp"

namespace tarsus::legged {

// A foot as it is: what is carried on to another part of the run.
inline CarriedFoot handed_on(const LeggedFoot& foot) {
  CarriedFoot out = tarsus::handed_on(foot.contact, foot, foot.apex);
  out.start = foot.start;
  out.sense = foot.sense[ALONG];
  out.place = foot.sense[ACROSS];
  out.slipped = foot.slipped;
  out.facet = double(foot.ground.number);
  out.wedged = foot.wedged;
  return out;
}
inline void take_on(const CarriedFoot& from, LeggedFoot& foot) {
  tarsus::take_on(from, foot, foot.apex);
  foot.contact = Contact(int(from.contact));
  foot.start = int(from.start);
  foot.sense[ALONG] = from.sense;
  foot.sense[ACROSS] = from.place;
  foot.slipped = from.slipped;
}

// Where a robot has come to, its displacements and velocities (2 n), and what its feet carry on.
inline void hand_on(LeggedMarch& s, std::vector<double>& states, std::vector<CarriedFoot>& feet) {
  s.rebase();  // so that the rates are those of the feet
  const double* const body[2] = {s.x, s.v};
  for (int k = 0; k < 2; k++) {
    states.insert(states.end(), body[k], body[k] + s.coordinates());
    for (int i = 0; i < s.legs(); i++) {
      const double* of = k == 0 ? s.feet[i].u : s.feet[i].w;
      double own[DIRECTIONS] = {of[UP], of[ALONG]};
      in_world(s, i, own);
      states.insert(states.end(), {own[ALONG], own[UP]});
    }
    for (int i = 0; i < s.legs() && s.directions() > DIRECTIONS; i++) states.push_back(k == 0 ? s.feet[i].u[ACROSS] : s.feet[i].w[ACROSS]);
  }
  for (int i : s.body.leg) feet.push_back(handed_on(s.feet[i]));
}

// Put a foot of a run that goes on on the facet where it was, in whose directions it lives where it is on the ground.
inline void go_on_facet(LeggedMarch& s, int i, const CarriedFoot& from) {
  LeggedFoot& foot = s.feet[i];
  const Contact contact = foot.contact;
  foot.contact = AIR;
  if (!std::isnan(from.facet)) pass_over(s, i, profile_of(s, i).facet(int64_t(from.facet)));
  foot.wedged = int(from.wedged);
  if (contact == AIR) return;
  turn(s, i);
  foot.contact = contact;
  foot.u[UP] = s.body.legs[i].standing();
  foot.w[UP] = 0.0;
  if (contact == STUCK) foot.w[ALONG] = 0.0;
}

// Set a run that has just begun to its start: held feet stand still, or slide where they move along the ground.
inline void begin_at(LeggedMarch& s, const Beginning& start) {
  start_clock(s.clock, s.settings, start);
  for (int i : s.body.leg) {
    const int f = s.body.legs[i].foot;
    s.feet[i].apex.restart(start.time);
    if (start.feet != nullptr) {
      take_on(start.feet[f], s.feet[i]);
      if (s.profile != nullptr) go_on_facet(s, i, start.feet[f]);
    } else if (start.held[f]) {
      if (s.profile != nullptr) turn(s, i);
      begin_contact(s, i);
      s.feet[i].since = start.since[f];
    } else {
      s.feet[i].parted = start.time;
      if (start.leaving[f]) s.feet[i].start = JUST_LEFT;
    }
  }
  assemble_coupling(s);
}

}  // namespace tarsus::legged
