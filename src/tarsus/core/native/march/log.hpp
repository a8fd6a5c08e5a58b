// The one event log: the events of the feet, and the highest gap since the last of each.
#pragma once
#include <vector>

#include "march/kinds.hpp"

namespace tarsus {

// One event. Forces [N], energies [J]; apex [m] is the highest gap of the flight or period that ends here, at apex_time
// [s]; gap_integral [m s] of the gap since the start (NaN where apexes are not tracked).
struct Event {
  double time, foot, kind, before, after, pull, strength, energy, adhesion, apex, apex_time, gap_integral;
};
constexpr int EVENT_WIDTH = sizeof(Event) / sizeof(double);

// Numbers of an event.
struct EventNumbers {
  double when = 0.0, before = 0.0, after = 0.0, pull = 0.0, strength = 0.0, energy = 0.0, adhesion = 0.0;
};

// Highest gap of a foot since its last event or mark, when, and the integral of the gap since the start of the run.
struct Apex {
  double gap = 0.0, time = 0.0, integral = 0.0;
  void restart(double now) {
    gap = 0.0;
    time = now;
  }
};

struct Log {
  std::vector<Event> events;

  void add(double t, int foot, EventKind kind, const Apex& apex, double before = 0.0, double after = 0.0,
           double pull = 0.0, double strength = 0.0, double energy = 0.0, double adhesion = 0.0) {
    events.push_back({t, double(foot), double(kind), before, after, pull, strength, energy, adhesion, apex.gap,
                      apex.time, apex.integral});
  }
  void add(int foot, EventKind kind, const Apex& apex, const EventNumbers& n) {
    add(n.when, foot, kind, apex, n.before, n.after, n.pull, n.strength, n.energy, n.adhesion);
  }
};

}  // namespace tarsus
