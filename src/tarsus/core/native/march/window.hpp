// A run from any moment on: where it starts, and to which step each of its events belongs.
#pragma once
#include <cmath>
#include <cstdint>
#include <vector>

#include "march/log.hpp"
#include "march/march.hpp"

namespace tarsus {

// Where a run starts, foot by foot. held: on the ground; since [s]: begin of that contact; leaving: a free foot at the
// ground has just been released, even where its contact would hold it; end [s]: of the window, where that is before the settings'.
struct Beginning {
  double time;
  const uint8_t *held, *leaving;
  const double* since;
  double end = INF;

  // The settings of a window.
  Settings ended(const Settings& settings) const {
    Settings out = settings;
    out.end = std::min(out.end, end);
    return out;
  }
};

// Origin of an event: located inside a step, which ends there; a consequence, at the same time, of an event before; or a mark.
enum Origin { LOCATED, CONSEQUENT, MARKED };

// To which step an event of the log belongs: the number of steps recorded before it, and its origin.
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
