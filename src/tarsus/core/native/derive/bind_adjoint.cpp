// Derivatives of one number of a recorded window by all of its data, in Python.
#include <nanobind/stl/tuple.h>

#include "derive/convert.hpp"
#include "march/rows.hpp"

namespace tarsus {

using namespace modal;

namespace {

// groups (feet, columns): number of the group that a law's parameter moves with, or -1; degrees (pieces): highest power of xi
// in a piece or in a derivative of it; seeds: derivatives of the number by event rows (events, 12) and by samples at times
// (times, width).
//
// Returns derivatives of the number by groups, initial state, sources, coef, begin, end, loops and the period; flags
// (flags, 3): event, reason, lane -1; edges (edges, 3) at the very start: piece, turns, channel; whether it gave up.
nb::tuple adjoint_modal(Book& book, const Nodes& nodes, const Signals& signals, const Laws& laws,
                        const Settings& settings, nb::handle rows, nb::handle start, const Integers& groups, const Integers& degrees,
                        nb::handle recorded, nb::handle seeds) {
  const Sizes& sizes = book.sizes;
  const size_t m = size_t(laws.feet);
  const Rows given(rows, signals, m * laws.columns, 2 * size_t(sizes.coordinates), m, sizes.drives);
  const WindowRecord window(start, recorded, sizes, m);
  const auto [by_events, times, by_samples] = nb::cast<std::tuple<Doubles, Doubles, Doubles>>(seeds);
  const size_t width = tangent_width(sizes);
  if (by_events.size() != window.events.size() || by_samples.size() != times.size() * width ||
      groups.size() != m * laws.columns || degrees.size() != signals.start.size()) {
    throw std::invalid_argument("the sizes of a recorded run and of what is asked of it differ");
  }
  const Objective objective{by_events.data(), times.data(), by_samples.data(), times.size()};
  AdjointResult found;
  {
    nb::gil_scoped_release released;
    found = adjoint({book, nodes, signals, laws, settings, given.batch.channels}, given.batch.of(0), window.begun(),
                    DataTangents::none(size_t(sizes.coordinates), laws, signals), copied(groups), copied(degrees), window.record(), objective);
  }
  DataAdjoint& by = found.data;
  return nb::make_tuple(
      nb::make_tuple(returned(std::move(by.groups)), returned(std::move(by.initial)), returned(std::move(by.sources)),
                     returned(std::move(by.coef), DEGREE), returned(std::move(by.begin)), returned(std::move(by.end)),
                     returned(std::move(by.loops)), by.period),
      returned_rows(std::move(found.flags)), returned(std::move(found.edges), 3), found.refused);
}

}  // namespace

void bind_adjoint(nb::module_& m) {
  m.def("adjoint_modal", &adjoint_modal);
  nb::dict doubts;  // see `Doubtful`
  for (size_t n = 0; n < std::size(DOUBTS); n++) doubts[DOUBTS[n]] = int(n) + 1;
  m.attr("DOUBTS") = doubts;
}

}  // namespace tarsus
