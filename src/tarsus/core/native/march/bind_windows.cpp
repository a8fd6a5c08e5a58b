// Many windows of one plan, each from its own start, with what they show at given times, in Python.
#include <nanobind/stl/tuple.h>

#include "base/convert.hpp"
#include "legged/run.hpp"
#include "march/rows.hpp"
#include "modal/run.hpp"
#include "record/samples.hpp"

namespace tarsus {

namespace {

typedef Array<uint8_t> Flags;
constexpr size_t TOGETHER = 64;  // windows whose recorded steps are kept at a time

// What windows run on: a pool of signals and rows of data.
struct WindowData {
  const Signals& signals;
  Rows rows;
};

// on: a list of (signals, rows).
std::vector<WindowData> window_data(nb::list on, size_t coordinates, const Laws& laws, size_t drives, size_t shape = 0) {
  std::vector<WindowData> out;
  const size_t m = size_t(laws.feet);
  for (nb::handle item : on) {
    const auto [signals, rows] = nb::cast<std::tuple<const Signals*, nb::object>>(item);
    out.push_back({*signals, Rows(rows, *signals, m * laws.columns, 2 * coordinates, m, drives, shape)});
  }
  return out;
}

// Where windows start and what is asked of them: states (nw, 2n); at (nw) [s]; held, leaving, since (nw, feet); data and row (nw, 2):
// what each runs on; first (nw + 1): its times, and after the last of them it ends; carried (nw, feet, CARRIED): of those that go on,
// NaN of others.
struct WindowStarts {
  Doubles states, at, since, times, carried;
  Flags held, leaving;
  Integers data, first;
  size_t count, width, feet;

  WindowStarts(nb::handle given, size_t wide, size_t m, const std::vector<WindowData>& on) : width(wide), feet(m) {
    std::tie(states, at, held, leaving, since, data, first, times, carried) =
        nb::cast<std::tuple<Doubles, Doubles, Flags, Flags, Doubles, Integers, Integers, Doubles, Doubles>>(given);
    count = at.size();
    bool fits = states.size() == count * width && held.size() == count * m && leaving.size() == count * m && since.size() == count * m &&
                data.size() == 2 * count && carried.size() == count * m * CARRIED && first.size() == count + 1 && first.data()[0] == 0 &&
                size_t(first.data()[count]) == times.size();
    for (size_t w = 0; fits && w < count; w++) fits = first.data()[w] < first.data()[w + 1];
    if (!fits) throw std::invalid_argument("the sizes of windows and of their starts differ");
    for (size_t w = 0; w < count; w++) {
      const int64_t k = source(w), row = data.data()[2 * w + 1];
      if (k < 0 || size_t(k) >= on.size() || row < 0 || size_t(row) >= on[k].rows.batch.runs) {
        throw std::invalid_argument("a window has no such data");
      }
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

// What windows came to, one after the other: codes, events and where those of each end, samples; states (nw, 2n) and feet (nw, feet):
// where each ended.
struct WindowsFound {
  std::vector<int64_t> codes, event_end;
  std::vector<Event> events;
  std::vector<double> samples, states;
  std::vector<CarriedFoot> feet;

  // Take on the windows of one call of the engine.
  template <class Result>
  void note(const Result& made) {
    const int64_t before = int64_t(events.size());
    codes.insert(codes.end(), made.codes.begin(), made.codes.end());
    for (int64_t end : made.event_end) event_end.push_back(before + end);
    events.insert(events.end(), made.events.begin(), made.events.end());
    states.insert(states.end(), made.states.begin(), made.states.end());
    feet.insert(feet.end(), made.feet.begin(), made.feet.end());
  }
  nb::tuple returned_as(size_t sample_width, size_t width) {
    return nb::make_tuple(returned(std::move(codes)), returned_rows(std::move(events)), returned(std::move(event_end)),
                          returned(std::move(samples), sample_width), returned(std::move(states), width), returned_rows(std::move(feet)));
  }
};

// Runs, and where they begin, of some windows on the same data.
struct Some {
  std::vector<RunData> runs;
  std::vector<Beginning> begun;
  std::vector<SampleTimes> times;

  Some(const WindowStarts& starts, size_t from, size_t to, const WindowData& on) {
    for (size_t w = from; w < to; w++) {
      runs.push_back(starts.run(w, on));
      begun.push_back(starts.begun(w));
      times.push_back(starts.times_of(w));
    }
  }
};

// on: a list of (signals, rows); given: see WindowStarts. Returns codes, events and where those of each window end, samples, states and
// feet at the ends.
nb::tuple windows_modal(modal::Book& book, const Nodes& nodes, const Laws& laws, const Settings& settings, nb::list on, nb::handle given) {
  const modal::Sizes& sizes = book.sizes;
  const size_t n = size_t(sizes.coordinates);
  const std::vector<WindowData> data = window_data(on, n, laws, sizes.drives);
  const WindowStarts starts(given, 2 * n, size_t(sizes.feet), data);
  WindowsFound out;
  {
    nb::gil_scoped_release released;
    for (size_t w = 0, last; w < starts.count; w = last) {
      last = starts.alike(w, TOGETHER);
      const WindowData& own = data[size_t(starts.source(w))];
      const Some some(starts, w, last, own);
      const modal::ModalResult made = modal::run_modal({book, nodes, own.signals, laws, settings, own.rows.batch.channels}, some.runs, some.begun);
      out.note(made);
      size_t step = 0;
      for (size_t k = 0; k < some.runs.size(); k++) {
        const size_t steps = size_t(made.trace_end[k]) - step;
        const double* trace = made.trace.data() + step * modal::recorded_width(sizes);
        const auto seen = modal::sample_steps(book, nodes, some.runs[k].sources, trace, steps, some.times[k].at, some.times[k].count);
        out.samples.insert(out.samples.end(), seen.begin(), seen.end());
        step += steps;
      }
    }
  }
  return out.returned_as(modal::sample_width(sizes), 2 * n);
}

nb::tuple windows_legged(const legged::Body& body, const legged::LegTables& tables, const Nodes& nodes, const Laws& laws,
                         const Settings& settings, nb::list on, nb::handle given) {
  const size_t n = size_t(body.all_coordinates());
  const std::vector<WindowData> data = window_data(on, n, laws, body.drives, body.shape());
  const WindowStarts starts(given, 2 * n, size_t(body.feet()), data);
  WindowsFound out;
  {
    nb::gil_scoped_release released;
    for (size_t w = 0, last; w < starts.count; w = last) {
      last = starts.alike(w, starts.count);
      const WindowData& own = data[size_t(starts.source(w))];
      const Some some(starts, w, last, own);
      const legged::LeggedResult made =
          legged::run_legged({body, tables, nodes, own.signals, laws, settings, own.rows.batch.channels}, some.runs, some.begun, some.times, false);
      out.note(made);
      out.samples.insert(out.samples.end(), made.samples.begin(), made.samples.end());
    }
  }
  return out.returned_as(starts.times.size() ? out.samples.size() / starts.times.size() : 0, 2 * n);
}

}  // namespace

void bind_windows(nb::module_& m) {
  m.def("windows_modal", &windows_modal);
  m.def("windows_legged", &windows_legged);
}

}  // namespace tarsus
