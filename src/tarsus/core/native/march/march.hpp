// The loop from event to event, the same for every system.
#pragma once
#include <utility>

#include "march/batch.hpp"
#include "march/kinds.hpp"
#include "base/simd.hpp"

namespace tarsus {

// Rounding error of a sum, as a part of the sum of its terms' sizes: 45 units in the last place. A gap, rate or pull of a foot is a
// product of rows after a projection and a shift, of some tens of terms each, by arrays in which a linear algebra library has left
// as many units. The bound decides whether such a number is zero: in every contact mode, and wherever an impact has taken speed.
constexpr double ROUNDING = 1e-14;

// The tolerances of a plan or of one of its runs, and its duration and period. Lengths [m], forces [N], times [s].
struct Settings {
  double end, period;               // duration; period of the marks (infinite: none)
  double gap, drive;                // local error of a gap, and of a drive relative to its span, per step
  double gap_zero, force_zero, speed_zero;  // below which a gap, a force, a rate is zero by the scales of a scene
  double rest_height, least_flight; // flights lower than these do not count: relative to the widest gap, and in any case [m]
  double least_progress;            // [s] a smaller step of time is no progress
  double probe;                     // gap over which a slope is taken by differences
  int64_t most_steps, first_class;
  double widest = 1.0;              // gap at rest
  bool track;                       // find the apex of every flight

  // The settings of a run of so many feet, from these, which are for a length and a force of one. Its widest gap scales the bounds
  // below which a number is zero and a flight does not count.
  Settings of(const RunData& run, int feet) const {
    Settings out = *this;
    out.widest = run.scales[0];
    for (int i = 0; i < feet; i++) out.widest = std::max(out.widest, std::fabs(run.sources[i]));
    for (double* size : {&out.gap, &out.probe}) *size *= run.scales[0];
    for (double* size : {&out.gap_zero, &out.speed_zero, &out.rest_height}) *size *= out.widest;
    out.rest_height = std::max(out.rest_height, least_flight);
    out.force_zero *= run.scales[1];
    out.period = run.scales[2];
    return out;
  }
};

constexpr int MOST_STALLED = 4000;  // events without progress of time: a pile of feet that land at once has some hundreds

// A run crawls where so many steps in a row would have to go on ``CRAWL`` times as long as a run may, to its end: it would take hours and all memory.
constexpr int64_t CRAWLED = 1 << 17;  // some of `STEPS_PER_CALL`
constexpr double CRAWL = 1e4;

struct Clock {
  double time = 0.0, mark = INF, progress = -INF;
  int64_t steps = 0, rejected = 0, marks = 0;
  int stalled = 0;
  bool goes_on = false;  // what follows the end is another part of the run: no mark there
  double crawled = 0.0;  // [s] when it was last asked whether it crawls

  // False when too many events crowd one instant.
  bool progressed(const Settings& settings) {
    if (time - progress > settings.least_progress) {
      progress = time;
      stalled = 0;
      return true;
    }
    return ++stalled < MOST_STALLED;
  }

  // Asked once in ``CRAWLED`` steps.
  bool crawls(const Settings& settings) {
    const double way = time - std::exchange(crawled, time);
    return way * double(settings.most_steps) * CRAWL < (settings.end - time) * double(CRAWLED);
  }
};

// A System has: settings, clock; enter(): go over to the contact mode that an event has asked for; mark(): note the period's
// heights; resolve_contacts() -> whether a contact changed at the present time; step() -> GOING_ON or a code, having advanced to
// the end of a step, or to the first event inside it and applied that.

// Do what comes before the next step: marks, and contacts that change at the present time. GOING_ON where a step comes next.
template <class System>
TARSUS_INLINE Code before_step(System& system) {
  Clock& clock = system.clock;
  const Settings& settings = system.settings;
  for (;;) {
    system.enter();
    if (clock.time >= settings.end) {
      if (!clock.goes_on) system.mark();
      return DONE;
    }
    if (clock.time >= clock.mark) {
      system.mark();
      continue;
    }
    if (!system.resolve_contacts()) break;
    if (!clock.progressed(settings)) return STALL;
  }
  return ++clock.steps > settings.most_steps ? STEP_LIMIT : GOING_ON;
}

// Called by a run every `STEPS_PER_CALL` steps; throws where the run is to be given up (Ctrl-C in Python).
inline void (*give_way)() = nullptr;
constexpr int64_t STEPS_PER_CALL = 1 << 15;  // some 50 ms: short for a user who waits, and a call costs nothing compared with the steps

// What a run does once in ``STEPS_PER_CALL`` steps.
template <class System>
TARSUS_APART Code pause(System& system) {
  if (give_way != nullptr) give_way();
  return system.clock.steps % CRAWLED == 0 && system.clock.crawls(system.settings) ? STEP_TOO_SMALL : GOING_ON;
}

// Run a system from its start to its end or to what stops it.
template <class System>
Code march(System& system) {
  for (;;) {
    Code code = before_step(system);
    if (code == GOING_ON) code = system.step();
    if (code != GOING_ON) return code;
    if (!system.clock.progressed(system.settings)) return STALL;
    if (system.clock.steps % STEPS_PER_CALL == 0 && (code = pause(system)) != GOING_ON) return code;
  }
}

}  // namespace tarsus
