// Contacts that change at the present time: feet that land, alone or together, those that lie on the ground, and the events of a step.
#pragma once
#include "modal/together.hpp"

namespace tarsus::modal {

// A foot at the ground approaches: it bounces, is captured or rests, with all others that do so now. False if it does not approach, or cannot, since
// other held feet hold it as well (its rows are zero).
TARSUS_APART inline bool impact(Modal& m, int foot) {
  const ContactMode& mode = *m.mode;
  if (mode.mobility[foot] == 0.0) return false;
  const double t = m.clock.time;
  m.note_parts();
  add_film_momenta(m);
  const double rate = m.rate_of(foot), speed = std::max(-rate, 0.0), zero = m.no_rate(foot);
  if (speed <= zero) {
    remove_film_momenta(m);
    return false;
  }
  if (m.sizes.feet > 1) {
    std::vector<Struck> feet = landing_now(m, foot);
    if (feet.size() > 1) {
      land_together(m, std::move(feet));
      return true;
    }
  }
  m.gaps[foot] = 0.0;
  Landing at = landing_of(m, foot);
  const std::vector<Broken> broken = broken_by_impact(m, foot, at);
  if (!broken.empty()) {
    m.feet[foot].departure = DUE;
    release_by_impact(m, broken);
    return true;
  }
  if (at.after == 0.0) at.none = no_pull(m, foot, t);
  count_low(m, foot, speed, t);
  const EventKind kind = landing_kind(m.laws, foot, at, m.settings.rest_height);
  if (kind != BOUNCE) {
    m.begin_notes();
    m.feet[foot].forces = pull_parts(m, foot, t);
  }
  const double lost = follow_landing(m, foot, kind, at).lost;
  m.log.add(foot, kind, m.feet[foot].apex, numbers_of(m.laws, foot, kind, t, at, lost));
  if (kind != BOUNCE) {
    hold(m, foot, t);
    return true;
  }
  remove_film_momenta(m);
  turn_over(m, foot, at.after > zero ? RISING : FROM_REST, t);
  return true;
}

// How each foot that has just left the ground departs, after impacts on the others changed its rate: rising, from rest,
// or coming back at once (an impact is due).
inline void reconsider_departures(Modal& m) {
  add_film_momenta(m);
  for (int i : m.mode->free) {
    if (m.feet[i].departure <= UNDER_WAY) continue;
    const double rate = m.rate_of(i), zero = m.no_rate(i);
    m.feet[i].departure = rate > zero ? RISING : rate < -zero ? UNDER_WAY : FROM_REST;
  }
  remove_film_momenta(m);
}

// A foot at the ground that does not approach it, and the pull on it if it is held now.
struct Resting {
  int foot;
  double pull, strength, none;  // none: what the pull may exceed the strength by
};

// The pulls on them while all of them are held. The state is the modal one.
inline void find_pulls(Modal& m, std::vector<Resting>& feet) {
  FootSet with = m.mode->feet;
  for (const Resting& one : feet) with.set(one.foot, true);
  in_mode(m, m.book.require(with), [&] {
    const Moment at = moment_of(m);
    for (Resting& one : feet) one.pull = at.pull[one.foot] + (m.laws.has(one.foot, HAS_FORCE) ? m.force_now(one.foot, 0.0, 0.0) : 0.0);
    return 0.0;
  });
}

// Of feet that rest there those that stay while all of them are held: the pulls on the others exceed the strengths of their contacts. All that do so fall
// out together; not if none would stay of feet of which ``some`` do. The state is the modal one.
inline void find_held(Modal& m, std::vector<Resting>& feet, bool some) {
  if (feet.size() == 1) {
    feet[0].pull = pull_if_held(m, feet[0].foot);
  } else {
    find_pulls(m, feet);
  }
  const std::vector<Resting> all = feet;
  while (true) {
    const size_t before = feet.size();
    feet.erase(std::remove_if(feet.begin(), feet.end(), [](const Resting& one) { return one.pull > one.strength + one.none; }), feet.end());
    if (feet.empty() && some) feet = all;
    if (feet.empty() || feet.size() >= before) return;
    find_pulls(m, feet);
  }
}

// Feet at the ground that do not approach it: held are those that no pull takes off; of those that have just been ``pressed`` down again from rest some are.
// Returns whether any is held.
inline bool rest_on_ground(Modal& m, const std::vector<int>& feet, bool pressed = false) {
  const double t = m.clock.time;
  add_film_momenta(m);
  std::vector<Resting> resting;
  for (int i : feet) {
    m.feet[i].departure = RISING;
    if (m.rate_of(i) > m.no_rate(i)) continue;
    // a pull within rounding of zero, as at the time at which it changes its sign, holds no foot that has just been released, and
    // releases no other
    const bool released = m.just_released(i);
    const double strength = new_strength(m, i), none = no_pull(m, i, t) + ROUNDING * std::fabs(strength);
    resting.push_back({i, 0.0, strength, released && !pressed ? -none : none});
    if (pressed && released) m.feet[i].low++;
    m.feet[i].departure = FROM_REST;
  }
  if (!resting.empty()) find_held(m, resting, pressed);
  FootSet held = m.mode->feet;
  for (const Resting& one : resting) {
    m.log.add(t, one.foot, CONTACT_AT_START, m.feet[one.foot].apex, 0.0, 0.0, one.pull, one.strength);
    held.set(one.foot, true);
    if (put_down(m, one.foot, t)) held.set(m.sizes.feet + one.foot, true);
  }
  const ContactMode& to = resting.empty() ? *m.mode : m.book.require(held);
  // a foot that other held feet hold as well, and that its share of their load would pull off, lies there without a
  // contact
  for (int i : feet) {
    if (m.feet[i].departure == FROM_REST && to.mobility[i] == 0.0) m.feet[i].departure = UNDER_WAY;
  }
  resting.empty() ? remove_film_momenta(m) : leave_mode(m, to);
  return !resting.empty();
}

// Contacts that change at the present time: feet on the ground that approach, or rest there and are held. Returns whether one has
// changed.
TARSUS_APART inline bool resolve_due_contacts(Modal& m) {
  m.note_parts();
  if (m.sizes.feet > 1) reconsider_departures(m);
  if (m.sizes.ways > 0 && reconsider_slides(m)) return true;
  for (const bool first : {true, false}) {  // an impact that has detached another foot comes before any impact of that foot
    std::vector<int> at_rest;
    for (int i : m.mode->free) {
      int& departure = m.feet[i].departure;
      if ((departure == DUE) != first) continue;
      if (departure > UNDER_WAY || (departure != DUE && m.gap_of(i) > m.no_gap(i))) continue;
      departure = UNDER_WAY;
      if (impact(m, i)) return true;
      at_rest.push_back(i);
    }
    if (!at_rest.empty() && rest_on_ground(m, at_rest)) return true;
  }
  return false;
}

// The events at the end of a step, all that come at one moment: feet that land have their impact, which changes the motion, and what is left of
// the others is found anew; else those that are pressed down from rest are held; else held feet leave and slip; else those that slide stop.
TARSUS_APART inline void happen(Modal& m) {
  const int feet = m.sizes.feet;
  std::vector<int> down, loose, stopped;
  std::vector<uint8_t> leaves;
  for (int e : m.happening) {
    const int i = e % feet;
    if (!m.mode->is_held[i]) {
      down.push_back(i);
    } else if (e >= feet && !m.mode->is_stuck[i]) {
      stopped.push_back(i);
    } else {
      const size_t k = std::find(loose.begin(), loose.end(), i) - loose.begin();
      if (k == loose.size()) loose.push_back(i);
      if (m.sizes.ways == 0) continue;
      leaves.resize(loose.size(), 0);
      leaves[k] = leaves[k] || e < feet;
    }
  }
  for (int i : down) {
    if (impact(m, i)) return;
  }
  if (!down.empty() && (rest_on_ground(m, down, true) || (loose.empty() && stopped.empty()))) return;
  if (!loose.empty()) return release_feet(m, std::move(loose), std::move(leaves));
  m.note_parts();
  add_film_momenta(m);
  std::sort(stopped.begin(), stopped.end());
  stop(m, std::move(stopped));
}

}  // namespace tarsus::modal
