// Where a part of a run starts, with what its feet carry on from the one before, and what it comes to.
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
// slide in a contact of a walker, begins, NaN where it was just released; slide: how one by contact modes does; sense
// of sliding, NaN of a held foot that sticks or slides as it moves, place [m] at which it sticks (of a walker's foot
// its sense across), path [m] slid; highest gap of the flight [m], when [s], the gap's integral [m s]; due: 1 where
// contacts may change at this very moment; of uneven ground the facet, by number, NaN: the one below it, and in the
// corner at which end of that it stands (LeggedFoot::wedged).
struct CarriedFoot {
  double contact, since, aged, parted, left, rose, low, start, slide, sense, place, slipped, apex, apex_time, integral, due, facet,
      wedged;

  bool as_it_moves() const { return std::isnan(sense); }
  int started(int released) const { return std::isnan(start) ? released : int(start); }
};
constexpr size_t CARRIED = sizeof(CarriedFoot) / sizeof(double);

// Where a part of a run starts and how far it goes [s], and what its feet carry on.
struct Start {
  double time, end;
  const CarriedFoot* feet;
};

// Moments of a run at which it is sampled, increasing [s].
struct SampleTimes {
  const double* at;
  size_t count;
};

// What runs come to, one after the other: codes; finish (runs, 3): end time [s], steps, rejected steps; events of run i are those from
// event_end[i - 1] on; samples (., sample_width) at the times asked for. states (runs, 2 n), feet (runs, feet) and, where an account is
// asked for, energies (runs, energy_width) at their ends: of parts, else of the last run.
struct Outcome {
  std::vector<int64_t> codes, event_end;
  std::vector<double> finish, samples, states, energies;
  size_t sample_width = 0, energy_width = 0;
  std::vector<CarriedFoot> feet;
  std::vector<Event> events;

  void note(Code code, const Clock& clock, const Log& log) {
    codes.push_back(code);
    event_end.push_back(int64_t(log.events.size()));
    finish.insert(finish.end(), {clock.time, double(clock.steps), double(clock.rejected)});
  }
};

inline void load_foot(const CarriedFoot& from, Grip& grip, Apex& apex) {
  grip.since = from.since;
  grip.aged = from.aged;
  grip.parted = from.parted;
  apex.gap = from.apex;
  apex.time = from.apex_time;
  apex.integral = from.integral;
}
inline CarriedFoot save_foot(Contact contact, const Grip& grip, const Apex& apex) {
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

// The clock of a part of a run, which has no marks.
inline Clock clock_at(const Start& start) {
  Clock out;
  out.time = start.time;
  out.goes_on = true;
  return out;
}

}  // namespace tarsus
