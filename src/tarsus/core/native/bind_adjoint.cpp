// Derivatives of one number of a recorded window by all of its data, in Python.
#include <nanobind/stl/tuple.h>

#include "adjoint_modal.hpp"
#include "convert_tangent.hpp"
#include "rows.hpp"

namespace tarsus {

using namespace modal;

namespace {

// groups (feet, columns): number of the group that a law's parameter moves with, or -1; degrees (pieces): highest power of xi
// in a piece or in a derivative of it; seeds: derivatives of the number by event rows (events, 12) and by samples at times
// (times, width).
//
// Returns derivatives of the number by groups, initial state, sources, coef, begin, end, loops, changes and the period; flags
// (flags, 3): event, reason, lane -1; edges (edges, 3) at the very start: piece, turns, channel; whether it gave up.
nb::tuple adjoint_modal(Book& book, const Nodes& nodes, nb::handle module, const Signals& signals, const Laws& laws,
                        const Settings& settings, nb::handle rows, nb::handle start, const Integers& groups, const Integers& degrees,
                        nb::handle recorded, nb::handle seeds) {
  const Sizes& sizes = book.sizes;
  const size_t m = size_t(laws.feet);
  const Rows given(rows, signals, m * laws.columns, 2 * size_t(sizes.coordinates), m, sizes.drives);
  const auto [at, held, leaving, since] = nb::cast<std::tuple<double, Flags, Flags, Doubles>>(start);
  const auto trace = nb::cast<Doubles>(recorded.attr("trace")), events = nb::cast<Doubles>(recorded.attr("events"));
  const auto notes = nb::cast<Doubles>(recorded.attr("notes"));
  const auto [by_events, times, by_samples] = nb::cast<std::tuple<Doubles, Doubles, Doubles>>(seeds);
  const size_t count = events.size() / EVENT_WIDTH, width = sample_width(sizes) - m;
  if (held.size() != m || leaving.size() != m || since.size() != m || notes.size() != 2 * count ||
      trace.size() % recorded_width(sizes) != 0 || by_events.size() != events.size() || by_samples.size() != times.size() * width ||
      groups.size() != m * laws.columns || degrees.size() != signals.start.size()) {
    throw std::invalid_argument("the sizes of a plan, of its recorded run and of what is asked of it differ");
  }
  const Halves halves = halves_of(module);
  const RunRecord record{trace.data(), trace.size() / recorded_width(sizes), reinterpret_cast<const Event*>(events.data()),
                         reinterpret_cast<const Note*>(notes.data()), count};
  const Beginning begun{at, held.data(), leaving.data(), since.data()};
  const Objective objective{by_events.data(), times.data(), by_samples.data(), times.size()};
  AdjointResult found;
  {
    nb::gil_scoped_release released;
    found = adjoint(book, nodes, halves, signals, laws, settings, given.batch.of(0), begun,
                    DataTangents::none(size_t(sizes.coordinates), laws, signals, given.batch.channels), given.batch.channels,
                    copied(groups), copied(degrees), record, objective);
  }
  DataAdjoint& by = found.data;
  return nb::make_tuple(
      nb::make_tuple(returned(std::move(by.groups)), returned(std::move(by.initial)), returned(std::move(by.sources)),
                     returned(std::move(by.coef), DEGREE), returned(std::move(by.begin)), returned(std::move(by.end)),
                     returned(std::move(by.loops)), returned(std::move(by.changes), 3), by.period),
      returned_rows(std::move(found.flags)), returned(std::move(found.edges), 3), found.refused);
}

}  // namespace

void bind_adjoint(nb::module_& m) { m.def("adjoint_modal", &adjoint_modal); }

}  // namespace tarsus
