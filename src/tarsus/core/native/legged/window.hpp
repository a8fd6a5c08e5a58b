// A legged robot's run from any moment on.
#pragma once
#include "legged/march.hpp"
#include "march/window.hpp"

namespace tarsus::legged {

// Set a run that has just begun to its start: held feet stand still, or slide where they move along the ground.
inline void begin_at(LeggedMarch& s, const Beginning& start) {
  start_clock(s.clock, s.settings, start.time);
  for (int i : s.body.leg) {
    const int f = s.body.legs[i].foot;
    s.feet[i].apex.restart(start.time);
    if (start.held[f]) {
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
