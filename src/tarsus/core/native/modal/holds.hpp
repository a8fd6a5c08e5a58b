// Feet whose contacts hold them no longer: they leave the ground, or begin to slide; and those that have come to a stop. All that leave or begin to
// slide or stop at one moment are decided on the motion of that moment, and change together.
#pragma once
#include "modal/stops.hpp"

namespace tarsus::modal {

// A foot that sticks and begins to slide, and what it bears.
struct Slipping {
  int foot;
  double sense;  // forward 1, backward -1
  Bearing at;
};

// Feet that leave the ground, and those that begin to slide, at one moment.
struct Parting {
  std::vector<int> leaving;
  std::vector<Slipping> slipping;

  // The contact mode without these contacts.
  const ContactMode& rest_of(Modal& m) const {
    const auto without = [&](int foot, bool held) -> const ContactMode& { return m.book.with_foot(*m.mode, foot, held, false); };
    if (leaving.size() == 1 && slipping.empty()) return without(leaving[0], false);
    if (slipping.size() == 1 && leaving.empty()) return without(slipping[0].foot, true);
    FootSet left = m.mode->feet;
    for (int i : leaving) left.set(i, false);
    for (int i = 0; i < m.sizes.ways; i++) left.set(m.sizes.feet + i, left.has(i) && m.mode->is_stuck[i]);
    for (const Slipping& one : slipping) left.set(m.sizes.feet + one.foot, false);
    return m.book.require(left);
  }
};

// The state is the modal one, and those that leave have no sense of sliding. Returns whether one of them is pressed down without its own friction:
// then that friction alone pulls it off, and no motion is consistent (see modal/friction.hpp): the run ends, and nothing has left.
inline bool friction_pulls_off(Modal& m, const Parting& parting) {
  if (m.sizes.ways == 0) return false;
  bool alone = false;
  std::vector<double> parts;
  for (int i : parting.leaving) parts.push_back(m.force_parts(i));
  in_mode(m, parting.rest_of(m), [&] {
    for (size_t k = 0; k < parts.size(); k++) {
      const int i = parting.leaving[k];
      alone = alone || (m.frictional[i] && pull_without_own_friction(m, i) < -CLOSE * parts[k]);
    }
    return 0.0;
  });
  return alone;
}

// Of feet whose pulls exceed the strengths of their contacts at one moment, those leave that nothing presses down once all of them have left: the others
// are held where these have left. The state is the modal one.
inline void leave_those_that_rise(Modal& m, Parting& parting) {
  while (parting.leaving.size() > 1) {
    std::vector<int> rise;
    in_mode(m, parting.rest_of(m), [&] {
      for (int i : parting.leaving) {
        if (m.mode->mobility[i] == 0.0 || pull_if_held(m, i) >= -no_pull(m, i, m.clock.time)) rise.push_back(i);
      }
      return 0.0;
    });
    if (rise.empty() || rise.size() == parting.leaving.size()) return;
    parting.leaving = std::move(rise);
  }
}

// The state is the modal one.
TARSUS_APART inline void part(Modal& m, Parting parting) {
  const double t = m.clock.time;
  std::vector<std::pair<int, double>> senses;
  for (int i : parting.leaving) {
    if (m.feet[i].sense != 0.0) senses.emplace_back(i, std::exchange(m.feet[i].sense, 0.0));
  }
  for (const Slipping& one : parting.slipping) m.feet[one.foot].sense = one.sense;
  leave_those_that_rise(m, parting);
  const bool none_follows = friction_pulls_off(m, parting);
  for (const auto& [i, sense] : senses) m.feet[i].sense = sense;  // of those that stay
  if (none_follows) {
    m.jammed = true;
    return remove_film_momenta(m);
  }
  const ContactMode& to = parting.rest_of(m);
  for (int i : parting.leaving) {
    const double strength = m.laws.has(i, HAS_LATCH) ? m.strength_now(i) : 0.0;
    m.log.add(t, i, RELEASE, m.feet[i].apex, 0.0, 0.0, strength, strength);
    m.feet[i].left = t;
    m.feet[i].end(t);
    turn_over(m, i, FROM_REST, t);
    m.feet[i].sense = 0.0;
  }
  for (const Slipping& one : parting.slipping) {
    if (m.feet[one.foot].supposed != t) m.log.add(t, one.foot, SLIP_BEGINS, m.feet[one.foot].apex, 0.0, 0.0, one.at.along, one.at.most);
    m.feet[one.foot].slide = FROM_REST;
  }
  leave_mode(m, to);
}

// What `bearing_of` finds for a foot that sticks, of the forces at the moment.
inline Bearing bearing_at(Modal& m, const Moment& at, int foot) {
  return {m.laws, foot, breaking_now(m, foot) - at.pull[foot], m.strength_now(foot), at.along[foot]};
}

// `pull_without_own_friction` of one of several feet whose contacts give way at one moment, without the friction of all of them.
inline double pull_without_their_friction(Modal& m, const std::vector<int>& feet, int foot) {
  FootSet set = m.mode->feet;
  for (int i : feet) set.set(m.sizes.feet + i, false);
  return pull_in(m, m.book.require(set), foot);
}

// The pulls on these feet exceed the strengths of their contacts, normal to the ground or along it; leaves, by foot: along the normal. Where a pull on a
// foot that sticks does so along the normal only because the foot sticks, the foot slides: without friction its contact holds it. Where friction bears that
// pull along the ground, it leaves.
TARSUS_APART inline void release_feet(Modal& m, std::vector<int> feet, std::vector<uint8_t> leaves) {
  m.note_parts();
  add_film_momenta(m);
  if (m.sizes.ways == 0) return part(m, {std::move(feet), {}});
  Parting parting;
  const Moment at = moment_of(m);
  for (size_t k = 0; k < feet.size(); k++) {
    const int i = feet[k];
    if (!m.mode->is_stuck[i]) {
      parting.leaving.push_back(i);
      continue;
    }
    const Bearing bears = bearing_at(m, at, i);
    const double none = no_margin(m, i);
    if (bears.margin < -none) leaves[k] = bears.holds(0.0) || m.strength_now(i) - pull_without_their_friction(m, feet, i) < none;
    if (leaves[k]) {
      parting.leaving.push_back(i);
    } else {
      parting.slipping.push_back({i, sense_of_slip(bears.along), bears});
    }
  }
  part(m, std::move(parting));
}

// Feet that slide have come to a stop: they stick, and `stick_or_turn` decides whether they stay so. The state is the modal one.
inline void stop(Modal& m, std::vector<int> feet) {
  FootSet with = m.mode->feet;
  for (int i : feet) with.set(m.sizes.feet + i, true);
  m.stopping = std::move(feet);
  leave_mode(m, m.book.require(with));
}

// A foot sticks from now on; along, most [N]: what friction bears of it, and can.
inline void stick(Modal& m, int foot, double along, double most) {
  m.log.add(m.clock.time, foot, STICK_BEGINS, m.feet[foot].apex, 0.0, 0.0, along, most);
  m.feet[foot].sense = 0.0;
}

// Whether a foot that has stopped had just begun to slide, and has not come anywhere: friction of that sense drives it the other way.
inline bool cannot_slide(const Modal& m, int foot) { return m.feet[foot].slide == FROM_REST; }

// Of several feet that stop at one moment, and that friction does not hold all by the forces as the contact mode has them: those that slide on do so against
// their friction (see modal/stops.hpp), one on which there is none with its pull. One that cannot slide so, to rounding, sticks. Where other shares of a load that
// lies on several hold all of them, the first that bear all they can, on the way from those shares to the contact
// mode's, are released, and go on to bear it.
inline Parting those_that_slide_on(Modal& m, const Moment& at) {
  std::vector<double> holding, senses;
  for (int i : m.stopping) holding.push_back(-at.along[i]);
  const std::vector<AtRest> found = friction_at_rest(m, holding);
  double first = 2.0;
  for (size_t k = 0; k < found.size(); k++) {
    const int i = m.stopping[k];
    const double sense = sense_of_slip(std::fabs(found[k].force) > NO_PART * std::fabs(holding[k]) ? -found[k].force : at.along[i]);
    senses.push_back(found[k].sticks() || (cannot_slide(m, i) && sense == m.feet[i].sense) ? 0.0 : sense);
    first = std::min(first, found[k].first_share());
  }
  const bool all = std::all_of(senses.begin(), senses.end(), [](double sense) { return sense == 0.0; });
  Parting parting;
  for (size_t k = 0; k < found.size(); k++) {
    const int i = m.stopping[k];
    const AtRest& friction = found[k];
    if (all && friction.first_share() <= (1.0 + CLOSE) * first) senses[k] = friction.share(1.0) < friction.share(-1.0) ? -1.0 : 1.0;
    if (senses[k] != 0.0) {
      parting.slipping.push_back({i, senses[k], bearing_at(m, at, i)});
    } else {
      stick(m, i, -friction.force, friction.most);
    }
  }
  return parting;
}

// Feet that stop stick where friction bears the pulls along the ground on all of them, or where these are as much as friction bears, to rounding, as of feet that can
// only move together. Else one that stops alone slides on in the direction of its pull. Other feet that slide may make
// it move against the pull, as their friction goes by what it takes of their push: then it slides so, if that lasts.
TARSUS_APART inline void stick_or_turn(Modal& m) {
  add_film_momenta(m);
  const Moment at = moment_of(m);
  const bool again = std::any_of(m.stopping.begin(), m.stopping.end(), [&](int i) { return cannot_slide(m, i); });
  Parting parting;
  std::vector<Bearing> bearings;
  bool all = true, at_bound = again;
  for (int i : m.stopping) {
    const Bearing bears = bearing_at(m, at, i);
    const double none = m.settings.force_zero + ROUNDING * m.force_parts(m.sizes.feet + i);
    const bool as_much = is_close(std::fabs(bears.along), bears.most);
    all = all && (bears.holds(none) || as_much);
    at_bound = at_bound || as_much;
    bearings.push_back(bears);
  }
  if (all) {
    for (size_t k = 0; k < bearings.size(); k++) {
      stick(m, m.stopping[k], bearings[k].along, bearings[k].most);
      if (at_bound) m.feet[m.stopping[k]].slide = FROM_REST;
    }
  } else if (bearings.size() > 1) {
    parting = those_that_slide_on(m, at);
  } else {
    const int i = m.stopping[0];
    const double sense = sense_of_slip(bearings[0].along);
    m.jammed = m.jammed || (again && m.feet[i].sense != sense);  // nor does it slide that way
    parting.slipping.push_back({i, again ? -sense : sense, bearings[0]});
  }
  m.stopping.clear();
  parting.slipping.empty() ? remove_film_momenta(m) : part(m, std::move(parting));
}

// Whether feet that slide go on as they do, after an impact on others changed their rates: those that it has stopped stick, and
// those that it has turned slide the other way. Returns whether a contact has changed.
inline bool reconsider_slides(Modal& m) {
  if (!m.stopping.empty()) {
    stick_or_turn(m);
    return true;
  }
  add_film_momenta(m);
  std::vector<int> stopped;
  for (int i : m.braked) {
    Foot& foot = m.feet[i];
    const double rate = m.along(m.mode->slide_rate, i);
    const bool none = std::fabs(rate) <= no_slide(m, i);
    const int begun = foot.slide;
    if (!none) foot.slide = UNDER_WAY;
    if (begun == UNDER_WAY && none) stopped.push_back(i);
    if (none || foot.sense * rate > 0.0) continue;
    foot.sense = -foot.sense;
    m.values[m.sizes.feet + i] = -m.values[m.sizes.feet + i];
    if (begun == UNDER_WAY) m.log.add(m.clock.time, i, SLIP_BEGINS, foot.apex);
  }
  const bool any = !stopped.empty();
  any ? stop(m, std::move(stopped)) : remove_film_momenta(m);
  return any;
}

}  // namespace tarsus::modal
