// The drive periods that measures are taken over.
#pragma once
#include "measure/windows.hpp"

namespace tarsus::measure {

constexpr double RESOLUTION = 1e-7;   // [m] height that a flight must clear to be seen: the resolution of the source's vibrometer
constexpr double DWELL = 5e-4;        // [s] see tarsus/measure/history.py
constexpr double DWELL_SHARE = 0.1;   // the same as a part of the drive period, where that is shorter
constexpr double WHOLE = 1.0 + 1e-9;  // a period that lacks less than this is whole

// What counts where nothing else is asked for.
inline Counting usual(double period) { return {RESOLUTION, std::min(DWELL, DWELL_SHARE * period)}; }

// Whole drive periods (count) of a run that reached a time, at least one, which is a broken one if need be, but none where no time
// passed; of these the first (dropped) are transient: so many as are asked for, but not the last one; -1: a third of several.
struct Used {
  int64_t dropped = 0, count = 0;
};
inline Used used(double reached, double period, int64_t skip = -1) {
  if (!(reached > 0.0)) return {};
  const int64_t count = std::max<int64_t>(int64_t(std::floor(reached / period * WHOLE)), 1);
  const int64_t third = count > 1 ? (count + 2) / 3 : 0;
  return {skip < 0 ? third : std::min(skip, count - 1), count};
}

// Edges [s] of the periods after those dropped; a single one ends where the run does at the latest.
inline Values edges_of(const Used& used, double period, double reached) {
  Values out;
  for (int64_t k = used.dropped; k <= used.count; k++) out.push_back(double(k) * period);
  if (used.count == 1) out[size_t(1 - used.dropped)] = std::min(period, reached);
  return out;
}

}  // namespace tarsus::measure
