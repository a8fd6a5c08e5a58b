// Many windows of one plan, each from its own start, with what they show at given times and derivatives of that.
#pragma once
#include "derive/convert.hpp"
#include "derive/run.hpp"
#include "march/rows.hpp"

namespace tarsus {

// What windows run on: a pool of signals and rows of data; and, of the first row, derivatives of that in blocks of eight lanes.
struct WindowData {
  const Signals& signals;
  Rows rows;
  std::vector<DataTangents> blocks;
};

// Where windows start and what is asked of them: states (nw, 2n); at (nw) [s]; held, leaving, since (nw, feet); data and row (nw, 2):
// what each runs on; first (nw + 1): its times, and after the last of them it ends; carried (nw, feet, CARRIED): of those that go on,
// NaN of others.
struct WindowStarts {
  Doubles states, at, since, times, carried;
  Flags held, leaving;
  Integers data, first;
  size_t count, width, feet;

  WindowStarts(nb::handle given, size_t wide, size_t m) : width(wide), feet(m) {
    std::tie(states, at, held, leaving, since, data, first, times, carried) =
        nb::cast<std::tuple<Doubles, Doubles, Flags, Flags, Doubles, Integers, Integers, Doubles, Doubles>>(given);
    count = at.size();
    bool fits = states.size() == count * width && held.size() == count * m && leaving.size() == count * m && since.size() == count * m &&
                data.size() == 2 * count && carried.size() == count * m * CARRIED && first.size() == count + 1 && first.data()[0] == 0 &&
                size_t(first.data()[count]) == times.size();
    for (size_t w = 0; fits && w < count; w++) fits = first.data()[w] < first.data()[w + 1];
    if (!fits) throw std::invalid_argument("the sizes of windows and of their starts differ");
  }

  void check(const std::vector<WindowData>& on) const {
    for (size_t w = 0; w < count; w++) {
      const int64_t k = source(w), row = data.data()[2 * w + 1];
      if (k < 0 || size_t(k) >= on.size() || row < 0 || size_t(row) >= on[k].rows.batch.runs) {
        throw std::invalid_argument("a window has no such data");
      }
    }
    for (const WindowData& one : on) {
      if (one.blocks.size() != on[0].blocks.size()) throw std::invalid_argument("windows have derivatives by different numbers");
    }
  }

  int64_t source(size_t w) const { return data.data()[2 * w]; }
  // The windows from one on that run on the same, no more than ``most``: behind the last of them.
  size_t alike(size_t w, size_t most) const {
    size_t last = w + 1;
    while (last < count && last - w < most && source(last) == source(w)) last++;
    return last;
  }
  RunData run(size_t w, const WindowData& on) const {
    RunData out = on.rows.batch.of(size_t(data.data()[2 * w + 1]));
    out.initial = states.data() + w * width;
    return out;
  }
  Beginning begun(size_t w) const {
    const auto* own = reinterpret_cast<const CarriedFoot*>(carried.data()) + w * feet;
    const bool goes_on = feet > 0 && !std::isnan(own->contact);
    return {at.data()[w], held.data() + w * feet, leaving.data() + w * feet, since.data() + w * feet, ending(w), goes_on ? own : nullptr};
  }
  SampleTimes times_of(size_t w) const { return {times.data() + first.data()[w], size_t(first.data()[w + 1] - first.data()[w])}; }
  double ending(size_t w) const { return times.data()[first.data()[w + 1] - 1]; }
};

// A flag of a window; event: of its own.
struct WindowFlag {
  double window, event, reason, lane;
};

// What windows came to, one after the other: codes, events and where those of each end, samples; by blocks of lanes derivatives of
// events and samples; flags, whose lanes count through the blocks; states (nw, 2n) and feet (nw, feet): where each ended.
struct WindowsFound {
  std::vector<int64_t> codes, event_end;
  std::vector<Event> events;
  std::vector<double> samples;
  std::vector<std::vector<Row>> event_slopes, sample_slopes;
  std::vector<WindowFlag> flags;
  std::vector<double> states;
  std::vector<CarriedFoot> feet;

  explicit WindowsFound(size_t blocks) : event_slopes(blocks), sample_slopes(blocks) {}

  void note(Code code, const Event* from, size_t many) {
    codes.push_back(code);
    events.insert(events.end(), from, from + many);
    event_end.push_back(int64_t(events.size()));
  }
  // Derivatives of a window with so many events.
  void note(size_t window, size_t block, size_t many, std::vector<Row> by_events, const std::vector<Row>& by_samples,
            const std::vector<TangentFlag>& flagged) {
    by_events.resize(many * EVENT_WIDTH, Row(NOT_A_NUMBER));
    event_slopes[block].insert(event_slopes[block].end(), by_events.begin(), by_events.end());
    sample_slopes[block].insert(sample_slopes[block].end(), by_samples.begin(), by_samples.end());
    for (const TangentFlag& one : flagged) {
      flags.push_back({double(window), one.event, one.reason, one.lane < 0.0 ? -1.0 : one.lane + double(block * LANES)});
    }
  }

  nb::tuple returned_as(size_t sample_width, size_t width) {
    nb::list by_events, by_samples;
    for (auto& one : event_slopes) by_events.append(returned_rows(std::move(one)));
    for (auto& one : sample_slopes) by_samples.append(returned_rows(std::move(one)));
    return nb::make_tuple(returned(std::move(codes)), returned_rows(std::move(events)), returned(std::move(event_end)),
                          returned(std::move(samples), sample_width), by_events, by_samples, returned_rows(std::move(flags)), returned(std::move(states), width),
                          returned_rows(std::move(feet)));
  }
};

// on: a list of (signals, rows, blocks of derivatives).
inline std::vector<WindowData> window_data(nb::list on, size_t coordinates, const Laws& laws, size_t drives, size_t shape = 0) {
  std::vector<WindowData> out;
  for (nb::handle item : on) {
    const auto [signals, rows, blocks] = nb::cast<std::tuple<const Signals*, nb::object, nb::list>>(item);
    const size_t m = size_t(laws.feet);
    out.push_back({*signals, Rows(rows, *signals, m * laws.columns, 2 * coordinates, m, drives, shape), {}});
    for (nb::handle block : blocks) {
      out.back().blocks.push_back(data_tangents(block, coordinates, laws, *signals, shape));
    }
  }
  return out;
}

}  // namespace tarsus
