// Contacts that change at the present time: feet that land, alone or together, and those that lie on the ground.
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
  Landing<double> at = landing_of(m, foot);
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

// A foot at the ground that does not approach it: held where no pull exceeds its strength, or where it has just been
// ``pressed`` down again from rest. Returns whether it is held.
inline bool rest_on_ground(Modal& m, int foot, bool pressed = false) {
  add_film_momenta(m);
  int& departure = m.feet[foot].departure;
  departure = RISING;
  if (m.rate_of(foot) <= m.no_rate(foot)) {
    const double t = m.clock.time, pull = pull_if_held(m, foot), strength = new_strength(m, foot);
    // a pull within rounding of zero, as at the time at which it changes its sign, holds no foot that has just been released, and
    // releases no other
    const bool let_go = m.just_let_go(foot);
    const double none = no_pull(m, foot, t) + ROUNDING * std::fabs(strength);
    if (pressed && let_go) m.feet[foot].low++;
    if (pressed || pull <= strength + (let_go ? -none : none)) {
      m.log.add(t, foot, CONTACT_AT_START, m.feet[foot].apex, 0.0, 0.0, pull, strength);
      hold(m, foot, t);
      return true;
    }
    // a foot that other held feet hold as well, and that would be pulled off by its share of their load, lies there without a
    // contact
    departure = m.mode->mobility[foot] > 0.0 ? FROM_REST : UNDER_WAY;
  }
  remove_film_momenta(m);
  return false;
}

// Contacts that change at the present time: feet on the ground that approach, or rest there and are held. Returns whether one has
// changed.
TARSUS_APART inline bool resolve_due_contacts(Modal& m) {
  m.note_parts();
  if (m.sizes.feet > 1) reconsider_departures(m);
  if (m.sizes.ways > 0 && reconsider_slides(m)) return true;
  for (const bool first : {true, false}) {  // an impact that has detached another foot comes before any impact of that foot
    for (int i : m.mode->free) {
      int& departure = m.feet[i].departure;
      if ((departure == DUE) != first) continue;
      if (departure > UNDER_WAY || (departure != DUE && m.gap_of(i) > m.no_gap(i))) continue;
      departure = UNDER_WAY;
      if (impact(m, i) || rest_on_ground(m, i)) return true;
    }
  }
  return false;
}

}  // namespace tarsus::modal
