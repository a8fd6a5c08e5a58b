// Derivatives of recorded windows in Python.
#include <nanobind/stl/tuple.h>

#include "base/convert.hpp"
#include "derive/convert.hpp"
#include "march/rows.hpp"
#include "derive/modal.hpp"

namespace tarsus {

using namespace modal;

namespace {

// Derivatives of a recorded window in eight lanes; ``laws`` by programs alone, ``data`` those of what enters; structural:
// the derived book and the lane of every number of the structure.
//
// Returns derivatives of the event rows (events, 12, 8), of samples at ``times`` (times, width, 8), of recorded steps (rows,
// width, 8) where they are kept, and flags (flags, 3): event, reason, lane.
nb::tuple tangents_modal(Book& book, const Nodes& nodes, nb::handle module, const Signals& signals, const Laws& laws,
                         const Settings& settings, nb::handle rows, nb::handle start, nb::handle data, nb::list structural,
                         nb::handle recorded, const Doubles& times, bool keep) {
  const Sizes& sizes = book.sizes;
  const size_t m = size_t(laws.feet);
  const Rows given(rows, signals, m * laws.columns, 2 * size_t(sizes.coordinates), m, sizes.drives);
  const WindowRecord window(start, recorded, sizes, m);
  const DataTangents tangents = data_tangents(data, size_t(sizes.coordinates), laws, signals, given.batch.channels);
  std::vector<Structural> numbers;
  for (nb::handle item : structural) {
    const auto [by, lane] = nb::cast<std::tuple<DerivedBook*, int>>(item);
    if (&by->book != &book || lane < 0 || lane >= LANES) throw std::invalid_argument("derivatives of the structure are those of its book");
    numbers.push_back({by, lane});
  }
  const Halves halves = halves_of(module);
  TangentResult result;
  {
    nb::gil_scoped_release released;
    ModalTangent march(book, nodes, halves, signals, laws, settings, given.batch.of(0), window.begun(), tangents, given.batch.channels, numbers);
    result = march.run(window.record(), times.data(), times.size(), keep);
  }
  return nb::make_tuple(returned_rows(std::move(result.events)), returned_rows(std::move(result.samples)),
                        returned_rows(std::move(result.steps)), returned_rows(std::move(result.flags)));
}

}  // namespace

void bind_window(nb::module_& m) {
  m.def("tangents_modal", &tangents_modal);
}

}  // namespace tarsus
