// Derivatives of a run's data from Python.
#pragma once
#include "base/convert.hpp"
#include "record/replay.hpp"
#include "derive/run.hpp"

namespace tarsus {

typedef Array<uint8_t> Flags;

// A recorded window of a modal system as Python has it, and where it began: arrays that are kept for as long as this.
struct WindowRecord {
  double at;
  Flags held, leaving;
  Doubles since, trace, events, notes;
  size_t steps, count;

  WindowRecord(nb::handle start, nb::handle recorded, const modal::Sizes& sizes, size_t feet) {
    std::tie(at, held, leaving, since) = nb::cast<std::tuple<double, Flags, Flags, Doubles>>(start);
    trace = nb::cast<Doubles>(recorded.attr("trace"));
    events = nb::cast<Doubles>(recorded.attr("events"));
    notes = nb::cast<Doubles>(recorded.attr("notes"));
    steps = trace.size() / modal::recorded_width(sizes);
    count = events.size() / EVENT_WIDTH;
    if (held.size() != feet || leaving.size() != feet || since.size() != feet || notes.size() != 2 * count ||
        trace.size() % modal::recorded_width(sizes) != 0) {
      throw std::invalid_argument("the sizes of a plan and of its recorded run differ");
    }
  }
  modal::RunRecord record() const {
    return {trace.data(), steps, reinterpret_cast<const Event*>(events.data()), reinterpret_cast<const Note*>(notes.data()), count};
  }
  Beginning begun() const { return {at, held.data(), leaving.data(), since.data()}; }
};

// Rows of eight lanes from an array (..., 8).
inline std::vector<Row> lanes(nb::handle group, const char* name, size_t count) {
  const auto array = nb::cast<Doubles>(group.attr(name));
  if (array.size() != count * LANES) throw std::invalid_argument(std::string(name) + " has a wrong size");
  std::vector<Row> out;
  for (size_t n = 0; n < count; n++) out.push_back(load(array.data() + n * LANES));
  return out;
}

// coordinates: of the structure; profile: numbers of a ground's shape.
inline DataTangents data_tangents(nb::handle from, size_t coordinates, const Laws& laws, const Signals& signals, size_t profile) {
  const size_t m = size_t(laws.feet), pieces = signals.start.size();
  DataTangents out;
  out.parameters = lanes(from, "parameters", m * laws.columns);
  out.initial = lanes(from, "initial", 2 * coordinates);
  out.sources = lanes(from, "sources", m + GRAVITIES);
  out.since = lanes(from, "since", m);
  out.coef = lanes(from, "coef", pieces * DEGREE);
  out.begin = lanes(from, "begin", pieces);
  out.end = lanes(from, "end", pieces);
  out.loops = lanes(from, "loops", size_t(signals.channels()));
  out.profile = lanes(from, "profile", profile);
  out.period = lanes(from, "period", 1)[0];
  out.start = lanes(from, "start", 1)[0];
  return out;
}

}  // namespace tarsus
