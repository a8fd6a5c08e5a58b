// A run from any moment on: where it starts, and to which step each of its events belongs.
#pragma once
#include <cmath>
#include <cstdint>
#include <vector>

#include "march/grip.hpp"
#include "march/log.hpp"
#include "march/march.hpp"

namespace tarsus {

// What a foot carries on from one part of a run to the next, a row of numbers. contact: air, stuck or sliding; since, aged, parted [s]:
// as in Grip; left, rose, low: of its last contact and of flights too low to count (see modal::Foot); start: how its flight, or its
// slide in a contact of a walker, begins; slide: how one by contact modes does; sense of sliding, place [m] at which it sticks (of a walker's foot its sense across), path
// [m] slid; highest gap of the flight [m], when [s], the gap's integral [m s]; due: 1 where contacts may change at this very moment; of
// uneven ground the facet, by number, NaN: the one below it, and in the corner at which end of that it stands (LeggedFoot::wedged).
struct CarriedFoot {
  double contact, since, aged, parted, left, rose, low, start, slide, sense, place, slipped, apex, apex_time, integral, due, facet,
      wedged;
};
constexpr size_t CARRIED = sizeof(CarriedFoot) / sizeof(double);

// Where a run starts, foot by foot. held: on the ground; since [s]: begin of that contact; leaving: a free foot at the
// ground has just been released, even where its contact would hold it; end [s]: of the window, by default the settings'.
// feet: of a run that goes on, in place of these three.
struct Beginning {
  double time;
  const uint8_t *held, *leaving;
  const double* since;
  double end = INF;
  const CarriedFoot* feet = nullptr;

  // The settings of a window.
  Settings ended(const Settings& settings) const {
    Settings out = settings;
    if (std::isfinite(end)) out.end = end;
    return out;
  }
  bool holds(int foot) const { return feet != nullptr ? feet[foot].contact != AIR : held[foot]; }
  double begun(int foot) const { return feet != nullptr ? feet[foot].since : since[foot]; }
};

// Moments of a run at which it is sampled, increasing [s].
struct SampleTimes {
  const double* at;
  size_t count;
};

inline void take_on(const CarriedFoot& from, Grip& grip, Apex& apex) {
  grip.since = from.since;
  grip.aged = from.aged;
  grip.parted = from.parted;
  apex.gap = from.apex;
  apex.time = from.apex_time;
  apex.integral = from.integral;
}
inline CarriedFoot handed_on(Contact contact, const Grip& grip, const Apex& apex) {
  CarriedFoot out = {};
  out.contact = contact;
  out.since = grip.since;
  out.aged = grip.aged;
  out.parted = grip.parted;
  out.apex = apex.gap;
  out.apex_time = apex.time;
  out.integral = apex.integral;
  return out;
}

// Origin of an event: located inside a step, which ends there; a consequence, at the same time, of an event before; or a mark.
enum Origin { LOCATED, CONSEQUENT, MARKED };

// To which step an event of the log belongs: the number of steps recorded before it, and its origin.
struct Note {
  double steps, origin;
};

// Begin of the marks of a run that starts somewhere.
inline void start_clock(Clock& clock, const Settings& settings, const Beginning& start) {
  const double time = start.time;
  clock = Clock();
  clock.time = time;
  clock.goes_on = start.feet != nullptr;
  clock.marks = std::isfinite(settings.period) ? int64_t(std::floor(time / settings.period * (1.0 + 1e-14))) : 0;
  clock.mark = (clock.marks + 1) * settings.period;
}

// A system for the march that also notes, where it records its steps, to which of them its events belong. recorded() -> number of
// steps so far.
template <class System>
struct Watched {
  System& system;
  std::vector<Note>& notes;
  Clock& clock;
  const Settings& settings;

  Watched(System& s, std::vector<Note>& n) : system(s), notes(n), clock(s.clock), settings(s.settings) {}

  void enter() { system.enter(); }
  void mark() {
    system.mark();
    note(MARKED);
  }
  bool resolve_contacts() {
    const bool changed = system.resolve_contacts();
    note(CONSEQUENT);  // a foot that an impact turns along the ground is an event that changes no contact
    return changed;
  }
  Code step() {
    const Code code = system.step();
    note(LOCATED);
    return code;
  }

 private:
  TARSUS_INLINE void note(Origin origin) {
    if (settings.record && notes.size() < system.log.events.size()) {
      notes.resize(system.log.events.size(), {double(system.recorded()), double(origin)});
    }
  }
};

}  // namespace tarsus
