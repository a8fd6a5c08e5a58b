// A run from any moment on: where it starts, and to what each of its events belongs.
#pragma once
#include <cmath>
#include <cstdint>
#include <vector>

#include "march/log.hpp"
#include "march/march.hpp"

namespace tarsus {

// Where a run starts, foot by foot. held: on the ground; since [s]: begin of that contact; leaving: a free foot at the
// ground has just been let go, whatever would hold it.
struct Beginning {
  double time;
  const uint8_t *held, *leaving;
  const double* since;
};

// How an event came about: found inside a step, at its end; due at that very moment by what happened before; or a mark.
enum Origin { LOCATED, DUE_NOW, MARKED };

// What an event of the log belongs to: the number of steps recorded when it happened, and how it came about.
struct Note {
  double steps, origin;
};

// Begin of the marks of a run that starts at a given time.
inline void start_clock(Clock& clock, const Settings& settings, double time) {
  clock = Clock();
  clock.time = time;
  clock.marks = std::isfinite(settings.period) ? int64_t(std::floor(time / settings.period * (1.0 + 1e-14))) : 0;
  clock.mark = (clock.marks + 1) * settings.period;
}

// A system as the march takes it, that also notes what its events belong to where it records its steps. recorded() -> number of them
// so far.
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
    note(DUE_NOW);  // a foot that an impact turns along the ground is an event that changes no contact
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
