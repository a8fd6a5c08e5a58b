// An event of a foot of a legged robot with derivatives: what the run notes of it, gone through with numbers that have them.
//
// On uneven ground an event may be made of several things (legged::Deed). Between them the foot is in the robot's directions, with the
// momentum of its film in its rates, so that no change of facet changes it; each thing is done in the directions of its facet.
#pragma once
#include "derive/legged_instant.hpp"
#include "derive/shell.hpp"

namespace tarsus::legged {

class FootEvents {
 public:
  std::vector<Done> deeds;  // of the present event

  // acting, still: with the derivatives of laws, drives and ground, and without.
  FootEvents(const Legged& run, Acting& with, Acting& without, EventShell& shell) : s(run), acting(with), still(without), reported(shell) {}

  // Factors of the laws on a facet below a foot.
  void take_patch(int i, int64_t facet) {
    if (!s.body.patched) return;
    for (Acting* of : {&acting, &still}) {
      of->laws.patches.resize(s.body.feet());
      of->laws.patches[s.body.legs[i].foot] = of->patch(i, facet);
    }
  }

  // An event of a foot begins at a place; known: logged events before it; at_once: it shares the moment of the one before.
  void begin(JetPlace& place, int i, size_t known, bool at_once) {
    at_ = &place;
    known_ = known;
    at_once_ = at_once;
    deeds.clear();
    if (s.profile != nullptr) add_film(i, 1.0);
  }

  // It has changed the run: its place thereafter, and what is reported of it.
  void follow(int i, FootEvent kind) {
    acting.on(*at_);
    if (s.profile != nullptr && (!deeds.empty() || kind >= HIGH_END)) return follow_deeds(i);
    const bool logged = s.log.events.size() > known_;
    const int what = logged ? int(s.log.events.back().kind) : 0;
    EventNumbers<Jet> out;
    out.when = at_->time;
    Jet& along = acting.w(i, ALONG);
    if (kind == TOUCH) {
      flag_landing(what);
      out = acting.land(i, what);
      if (s.feet[i].contact == STUCK) stop_along(along);
    } else if (kind == PULL_OFF) {
      out.pull = pull_on(acting, i);
      out.strength = acting.strength(i);
      at_->grip[i].end(at_->time);
      acting.w(i, UP) = leaving_rate(acting, i, Jet(0.0));
      if (s.profile != nullptr) settle(i);
    } else {
      const Bearing<Jet> bearing = acting.bearing(i);
      out.pull = bearing.along;
      out.strength = bearing.most;
      out.doubtful = kind == STOP && is_close(Jet(std::fabs(bearing.along.value)), bearing.most);
      along = Jet(0.0);
    }
    if (logged) put(known_, i, out);
    if (!logged && out.doubtful) reported.flag(known_, AT_THRESHOLD);
  }

 private:
  const Legged& s;
  Acting &acting, &still;
  EventShell& reported;
  JetPlace* at_ = nullptr;
  size_t known_ = 0;
  bool at_once_ = false;

  void put(size_t event, int i, const EventNumbers<Jet>& out) {
    const int what = int(s.log.events[event].kind), f = s.body.legs[i].foot;
    if (out.doubtful) reported.flag(known_, AT_THRESHOLD);
    reported.put(event, f, out);
    if (what != SLIP_BEGINS && what != STICK_BEGINS) reported.restart(f, slope_of(at_->time));
  }

  // ---- on uneven ground

  // The rates of a foot with the film's momentum, or (by = -1) without.
  void add_film(int i, double by) {
    acting.on(*at_);
    if (!s.feet[i].filmed()) return;
    const Jet share = acting.momentum(i, acting.clearance(i)) / acting.mass(i) * by;
    for (int d = 0; d < DIRECTIONS; d++) acting.w(i, d) = acting.w(i, d) + acting.normal(i, d) * share;
  }
  void at_facet(int i, int64_t number) {
    if (acting.on(i)) acting.turn_back(i);
    at_->ground[i] = acting.facet(i, number);
    take_patch(i, number);
  }
  // Into the directions that the foot lives in from now on.
  void settle(int i) {
    at_facet(i, s.feet[i].ground.number);
    if (s.feet[i].contact != AIR) return acting.turn(i);
    add_film(i, -1.0);
  }

  void follow_deeds(int i) {
    std::vector<EventNumbers<Jet>> out(s.log.events.size() - known_);
    for (EventNumbers<Jet>& one : out) one.when = at_->time;
    Jet pull(0.0);
    for (const Done& one : deeds) {
      at_facet(i, one.facet);
      acting.turn(i);
      follow_deed(i, one, out, pull);
    }
    if (deeds.empty() && s.gap_now(i) < reported.room()) reported.flag(known_, AT_CORNER);
    settle(i);
    for (size_t n = 0; n < out.size(); n++) put(known_ + n, i, out[n]);
  }

  void follow_deed(int i, const Done& one, std::vector<EventNumbers<Jet>>& out, Jet& pull) {
    const size_t at = one.event - known_;
    const bool logged = at < out.size();
    const int what = logged ? int(s.log.events[one.event].kind) : 0, f = s.body.legs[i].foot;
    Jet &up = acting.w(i, UP), &along = acting.w(i, ALONG);
    const auto bear = [&](const Jet& by, const Jet& most) {
      if (logged) out[at].pull = by, out[at].strength = most;
    };
    if (one.what == LANDS || one.what == LANDS_PRESSED) {
      flag_landing(what);
      if (one.what == LANDS && deeds.size() == 1) flag_corner(i);
      const EventNumbers<Jet> found = acting.land(i, what, one.what == LANDS ? nullptr : &pull);
      if (logged) out[at] = found;
      if (Footing(s.laws.rubs(f, std::fabs(along.value)), along.value, s.settings.speed_zero).sticks && up.value == 0.0) stop_along(along);
    } else if (one.what == PRESSES || one.what == STANDS) {
      if (one.what == STANDS) up = along = Jet(0.0);
      const Pressing<Jet> by(acting.bearing(i), acting.corner(i, one.way), one.way);
      if (one.what == PRESSES) pull = -by.next;
      flag_pressing(i, one, by);
    } else if (one.what == SPENDS) {
      if (logged) out[at].energy = out[at].energy + 0.5 * acting.mass(i) * along * along;
    } else if (one.what == PARTS) {
      bear(pull_on(acting, i), acting.strength(i));
      at_->grip[i].end(at_->time);
    } else if (one.what == LIES) {
      bear(pull_on(acting, i), acting.laws.strength(f, acting.age_brought(i), acting.volts(f)));
      at_->grip[i].begin(acting.laws, f, at_->time);
    } else {
      const Bearing<Jet> by = acting.bearing(i);
      bear(by.along, by.most);
      if (is_close(Jet(std::fabs(by.along.value)), by.most)) reported.flag(known_, AT_THRESHOLD);
    }
  }

  // ---- where there is no derivative

  // Friction holds a foot that did not move along the ground, and would stop any motion only in time.
  void stop_along(Jet& along) {
    for (int lane = 0; lane < LANES; lane++) {
      if (along.slope[lane] != 0.0) reported.flag(known_, AT_THRESHOLD, lane);
    }
    along = Jet(0.0);
  }
  // A landing that hardly is one.
  void flag_landing(int what) {
    if (what == 0 || (what == CONTACT_AT_START && !at_once_)) reported.flag(known_, GRAZING);
  }
  // A foot on its facet so near to a corner that it could as well be on the next.
  void flag_corner(int i) {
    const FacetOf<Jet>& on = at_->ground[i];
    const double at = on.place_of(acting.place(i), acting.height(i)).value + acting.u(i, ALONG).value;
    const double length = on.high.value - on.low.value, size = std::isfinite(length) ? length : std::fabs(on.x.value) + std::fabs(on.z.value);
    for (int way : {1, -1}) {
      if (std::fabs(on.end(way).value - at) < CLOSE * size) reported.flag(known_, AT_CORNER);
    }
  }
  // A foot that a corner hardly presses, or hardly stops.
  void flag_pressing(int i, const Done& one, const Pressing<Jet>& by) {
    if (!acting.corner(i, one.way).rises()) {
      if (one.what == STANDS) reported.flag(known_, AT_CORNER);  // what holds a foot on a ridge is not followed
      return;
    }
    const double own = by.own.value, next = by.next.value;
    if (std::min(std::fabs(own), std::fabs(next)) < CLOSE * (std::fabs(own) + std::fabs(next))) reported.flag(known_, AT_CORNER);
    if (one.what != PRESSES || !by.holds()) return;
    const double speed = acting.w(i, ALONG).value, energy = 0.5 * s.body.legs[i].mass * speed * speed;
    if (is_close(energy, s.settings.rest_height * std::min(own, next))) reported.flag(known_, AT_CORNER);
  }
};

}  // namespace tarsus::legged
