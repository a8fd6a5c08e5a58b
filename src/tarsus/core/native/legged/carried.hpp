// A part of a legged robot's run: where it starts, and what its feet carry on.
#pragma once
#include "legged/march.hpp"
#include "march/carried.hpp"

namespace tarsus::legged {

inline CarriedFoot save_foot(const LeggedFoot& foot) {
  CarriedFoot out = tarsus::save_foot(foot.contact, foot, foot.apex);
  out.start = foot.start;
  out.sense = foot.sense[ALONG];
  out.place = foot.sense[ACROSS];
  out.slipped = foot.slipped;
  out.facet = double(foot.ground.number);
  out.wedged = foot.wedged;
  return out;
}

// Where a robot has come to, its displacements and velocities (2 n), and what its feet carry on.
inline void save(LeggedMarch& s, Outcome& out) {
  s.rebase();  // so that the rates are those of the feet
  std::vector<double>& states = out.states;
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
  for (int i : s.body.leg) out.feet.push_back(save_foot(s.feet[i]));
}

// Put a foot on the facet where it was, in whose directions it lives where it is on the ground.
inline void load_facet(LeggedMarch& s, int i, const CarriedFoot& from) {
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

inline void load_foot(LeggedMarch& s, int i, const CarriedFoot& from) {
  LeggedFoot& foot = s.feet[i];
  if (from.as_it_moves()) {
    if (s.profile != nullptr) turn(s, i);
    begin_contact(s, i);
    foot.since = from.since;
    if (foot.contact == STUCK) foot.supposed = s.clock.time;
    return;
  }
  tarsus::load_foot(from, foot, foot.apex);
  foot.contact = Contact(int(from.contact));
  foot.start = from.started(JUST_LEFT);
  foot.sense[ALONG] = from.sense;
  foot.sense[ACROSS] = from.place;
  foot.slipped = from.slipped;
  if (s.profile != nullptr) load_facet(s, i, from);
}

// Set a run that has just begun to its start.
inline void load(LeggedMarch& s, const Start& start) {
  s.clock = clock_at(start);
  for (int i : s.body.leg) load_foot(s, i, start.feet[s.body.legs[i].foot]);
  assemble_coupling(s);
}

}  // namespace tarsus::legged
