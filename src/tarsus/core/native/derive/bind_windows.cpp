// Many windows of one plan in one call, with derivatives, in Python.
#include <nanobind/stl/tuple.h>

#include "derive/windows.hpp"
#include "record/samples.hpp"

namespace tarsus {

namespace {

constexpr size_t TOGETHER = 64;  // windows whose recorded steps are kept at a time

// Everything that windows of a modal robot share.
struct ModalWindows {
  modal::Book& book;
  const Nodes& nodes;
  const Laws &laws, &programs;
  const Settings& settings;

  // Windows from one up to another, on the same data; structural: of every block.
  void run(const WindowStarts& starts, size_t from, size_t to, const WindowData& on,
           const std::vector<std::vector<modal::Structural>>& structural, WindowsFound& out) const {
    std::vector<RunData> runs;
    std::vector<Beginning> begun;
    for (size_t w = from; w < to; w++) {
      runs.push_back(starts.run(w, on));
      begun.push_back(starts.begun(w));
    }
    modal::ModalResult made = modal::run_modal({book, nodes, on.signals, laws, settings, on.rows.batch.channels}, runs, begun);
    out.states.insert(out.states.end(), made.states.begin(), made.states.end());
    out.feet.insert(out.feet.end(), made.feet.begin(), made.feet.end());
    size_t step = 0, event = 0;
    for (size_t k = 0; k < runs.size(); k++) {
      const size_t w = from + k, steps = size_t(made.trace_end[k]) - step, events = size_t(made.event_end[k]) - event;
      const double* trace = made.trace.data() + step * modal::recorded_width(book.sizes);
      for (size_t e = event; e < event + events; e++) made.notes[e].steps -= double(step);
      out.note(Code(made.codes[k]), made.events.data() + event, events);
      const auto seen = modal::sample_steps(book, nodes, runs[k].sources, trace, steps, starts.times_of(w).at, starts.times_of(w).count);
      out.samples.insert(out.samples.end(), seen.begin(), seen.end());
      const modal::RunRecord record{trace, steps, made.events.data() + event, made.notes.data() + event, events};
      for (size_t b = 0; b < on.blocks.size(); b++) {
        modal::TangentResult found = modal::derive_modal({book, nodes, on.signals, programs, settings, on.rows.batch.channels}, runs[k],
                                                         begun[k], on.blocks[b], structural[b], record, starts.times_of(w), nullptr);
        out.note(w, b, events, std::move(found.events), found.samples, found.flags);
      }
      step += steps;
      event += events;
    }
  }
};

// laws, programs: with twins and by programs alone; on: a list of (signals, rows, blocks of derivatives, of each block what is of
// the structure: its book and lane).
nb::tuple windows_modal(modal::Book& book, const Nodes& nodes, const Laws& laws, const Laws& programs,
                        const Settings& settings, nb::list on, nb::list structural, nb::handle given) {
  const modal::Sizes& sizes = book.sizes;
  const std::vector<WindowData> data = window_data(on, size_t(sizes.coordinates), laws, sizes.drives);
  const WindowStarts starts(given, 2 * size_t(sizes.coordinates), size_t(sizes.feet));
  starts.check(data);
  const size_t blocks = data.empty() ? 0 : data[0].blocks.size();
  std::vector<std::vector<std::vector<modal::Structural>>> numbers(data.size(), std::vector<std::vector<modal::Structural>>(blocks));
  for (nb::handle item : structural) {
    const auto [source, block, by, lane] = nb::cast<std::tuple<size_t, size_t, modal::DerivedBook*, int>>(item);
    if (source >= data.size() || block >= blocks || &by->book != &book || lane < 0 || lane >= LANES) {
      throw std::invalid_argument("derivatives of the structure are those of its book");
    }
    numbers[source][block].push_back({by, lane});
  }
  WindowsFound out(blocks);
  {
    nb::gil_scoped_release released;
    const ModalWindows windows{book, nodes, laws, programs, settings};
    for (size_t w = 0; w < starts.count;) {
      const size_t last = starts.alike(w, TOGETHER), source = size_t(starts.source(w));
      windows.run(starts, w, last, data[source], numbers[source], out);
      w = last;
    }
  }
  return out.returned_as(modal::sample_width(sizes), 2 * size_t(sizes.coordinates));
}

// Perturbed copies of a walker in a block of the data with a number.
struct Copies {
  size_t source, block;
  legged::PerturbedBody one;
};

// Everything that windows of a walker share.
struct LeggedWindows {
  const legged::Body& body;
  const legged::LegTables& tables;
  const Nodes& nodes;
  const Laws &laws, &programs;
  const Settings& settings;
  const std::vector<Copies>& copies;
  int lanes;  // numbers in all blocks

  void run(const WindowStarts& starts, size_t from, size_t to, const WindowData& on, WindowsFound& out) const {
    const legged::Walker walker{body, tables, nodes, on.signals, laws, settings, on.rows.batch.channels};
    std::vector<RunData> runs;
    std::vector<Beginning> begun;
    std::vector<SampleTimes> times;
    for (size_t w = from; w < to; w++) {
      runs.push_back(starts.run(w, on));
      begun.push_back(starts.begun(w));
      times.push_back(starts.times_of(w));
    }
    legged::LeggedResult made = legged::run_legged(walker, runs, begun, times, false);
    out.states.insert(out.states.end(), made.states.begin(), made.states.end());
    out.feet.insert(out.feet.end(), made.feet.begin(), made.feet.end());
    out.samples.insert(out.samples.end(), made.samples.begin(), made.samples.end());
    size_t event = 0;
    for (size_t k = 0; k < runs.size(); k++) {
      const size_t events = size_t(made.event_end[k]) - event;
      out.note(Code(made.codes[k]), made.events.data() + event, events);
      for (size_t b = 0; b < on.blocks.size(); b++) {
        const legged::Lanes numbers{on.blocks[b], std::min(LANES, lanes - int(b) * LANES), copies_of(size_t(starts.source(from + k)), b)};
        note(from + k, b, legged::derive_legged(walker, programs, runs[k], &begun[k], times[k], numbers, false), times[k].count, events, out);
      }
      event += events;
    }
  }

 private:
  std::vector<legged::PerturbedBody> copies_of(size_t source, size_t block) const {
    std::vector<legged::PerturbedBody> out;
    for (const Copies& one : copies) {
      if (one.source == source && one.block == block) out.push_back(one.one);
    }
    return out;
  }

  // Derivatives of a window of so many samples and events.
  void note(size_t window, size_t block, legged::LeggedDerived found, size_t samples, size_t events, WindowsFound& out) const {
    if (found.count != events) found.flags.push_back({0.0, double(LOST), -1.0});  // in chaos its steps may come to others
    found.slopes.samples.resize(samples * (2 * size_t(body.coordinates() + 2 * body.legs.size()) + 5 * size_t(body.feet())),
                                Row(NOT_A_NUMBER));
    out.note(window, block, events, std::move(found.events), found.slopes.samples, found.flags);
  }
};

// copies: a list of (data, block, body, tables, weight, lane); lanes: numbers in all blocks. Others as for windows_modal.
nb::tuple windows_legged(const legged::Body& body, const legged::LegTables& tables, const Nodes& nodes, const Laws& laws,
                         const Laws& programs, const Settings& settings, nb::list on, nb::list given_copies, int lanes, nb::handle given) {
  const size_t coordinates = size_t(body.all_coordinates());
  const std::vector<WindowData> data = window_data(on, coordinates, laws, body.drives, body.shape());
  const WindowStarts starts(given, 2 * coordinates, size_t(body.feet()));
  starts.check(data);
  std::vector<Copies> copies;
  for (nb::handle item : given_copies) {
    const auto [source, block, other, legs, weight, lane] =
        nb::cast<std::tuple<size_t, size_t, legged::Body*, legged::LegTables*, double, int>>(item);
    if (other->legs.size() != body.legs.size() || legs->lengths != tables.lengths || lane < 0 || lane >= LANES) {
      throw std::invalid_argument("perturbed copies of a walker have its legs and steps");
    }
    copies.push_back({source, block, {other, legs, weight, lane}});
  }
  WindowsFound out(data.empty() ? 0 : data[0].blocks.size());
  size_t width = 0;
  {
    nb::gil_scoped_release released;
    const LeggedWindows windows{body, tables, nodes, laws, programs, settings, copies, lanes};
    for (size_t w = 0; w < starts.count;) {
      const size_t last = starts.alike(w, starts.count);
      windows.run(starts, w, last, data[size_t(starts.source(w))], out);
      w = last;
    }
    width = starts.times.size() ? out.samples.size() / starts.times.size() : 0;
  }
  return out.returned_as(width, 2 * coordinates);
}

}  // namespace

void bind_windows(nb::module_& m) {
  m.def("windows_modal", &windows_modal);
  m.def("windows_legged", &windows_legged);
  nb::dict doubts;  // see `Doubtful`
  for (size_t n = 0; n < std::size(DOUBTS); n++) doubts[DOUBTS[n]] = int(n) + 1;
  m.attr("DOUBTS") = doubts;
}

}  // namespace tarsus
