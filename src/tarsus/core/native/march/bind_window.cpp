// Windows in Python: runs from given moments, and derivatives of them.
#include <nanobind/stl/tuple.h>

#include "base/convert.hpp"
#include "derive/convert.hpp"
#include "march/rows.hpp"
#include "derive/modal.hpp"
#include "record/window.hpp"

namespace tarsus {

using namespace modal;

namespace {

// Every window of a batch. times (runs,) [s]: where they start; held, leaving, since (runs, feet): see Beginning.
//
// Returns codes, events and where those of every run end, finish, recorded steps, and of the last run the contact mode it is in,
// its state, feet held in the one it was about to enter (or None) and its place; then notes on the events, and where the
// steps of every run end.
nb::tuple run_modal_windows(Book& book, const Nodes& nodes, const Signals& signals, const Laws& laws, const Settings& settings,
                            nb::handle rows, const Doubles& times, const Flags& held, const Flags& leaving,
                            const Doubles& since) {
  if (laws.feet != book.sizes.feet) throw std::invalid_argument("the book and the laws are of different feet");
  const size_t m = laws.feet;
  const Rows given(rows, signals, m * laws.columns, 2 * size_t(book.sizes.coordinates), m, book.sizes.drives);
  const size_t runs = given.batch.runs;
  if (times.size() != runs || held.size() != runs * m || leaving.size() != runs * m || since.size() != runs * m) {
    throw std::invalid_argument("the sizes of the windows and of their starts differ");
  }
  std::vector<Beginning> starts;
  for (size_t r = 0; r < runs; r++) {
    starts.push_back({times.data()[r], held.data() + r * m, leaving.data() + r * m, since.data() + r * m});
  }
  WindowResult result;
  {
    nb::gil_scoped_release released;
    result = run_windows(book, nodes, signals, laws, settings, given.batch, starts);
  }
  ModalResult& r = result.runs;
  nb::object pending = nb::none();
  if (r.pending != nullptr) {
    nb::list held;
    for (int i : r.pending->held) held.append(i);
    pending = held;
  }
  return nb::make_tuple(returned(std::move(r.codes)), returned_rows(std::move(r.events)), returned(std::move(r.event_end)),
                        returned(std::move(r.finish), 3), returned(std::move(r.trace), recorded_width(book.sizes)),
                        r.mode == nullptr ? 0 : r.mode->number, pending,
                        returned(std::move(r.physical)), returned_rows(std::move(result.notes)),
                        returned(std::move(result.trace_end)));
}

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
  m.def("run_modal_windows", &run_modal_windows);
  m.def("modal_stride", &modal_stride);
  m.def("tangents_modal", &tangents_modal);
}

}  // namespace tarsus
