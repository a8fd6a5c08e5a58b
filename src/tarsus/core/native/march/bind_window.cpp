// Derivatives of recorded windows in Python.
#include <nanobind/stl/tuple.h>

#include "base/convert.hpp"
#include "derive/convert.hpp"
#include "march/rows.hpp"
#include "derive/modal_power.hpp"

namespace tarsus {

using namespace modal;

namespace {

PowerArrays power_arrays(nb::handle system, const Sizes& sizes) {
  const size_t n = size_t(sizes.coordinates);
  PowerArrays out = {field<double>(system, "loads"), field<double>(system, "weight"), field<double>(system, "damping")};
  if (out.loads.size() != n * sizes.drives || out.weight.size() != n * GRAVITIES || out.damping.size() != n * n) {
    throw std::invalid_argument("arrays of a structure have wrong sizes");
  }
  return out;
}

// given: nothing, or the run's structure, and derivatives of its arrays by the lane of each of its numbers.
std::unique_ptr<PowerSlopes> power_slopes(nb::tuple given, const Nodes& nodes, const Book& book, const RunData& run,
                                          const DataTangents& data) {
  if (given.size() == 0) return nullptr;
  const Sizes& sizes = book.sizes;
  const auto [own, changes] = nb::cast<std::tuple<nb::object, nb::dict>>(given);
  std::vector<std::pair<int, PowerArrays>> by;
  for (auto [lane, change] : changes) by.emplace_back(nb::cast<int>(lane), power_arrays(change, sizes));
  Jet gravity[GRAVITIES];
  for (int g = 0; g < GRAVITIES; g++) gravity[g] = jet(run.sources[sizes.feet + g], data.sources[size_t(sizes.feet + g)]);
  return std::make_unique<PowerSlopes>(sizes, GaussPoints{nodes.gauss, nodes.gauss_weights},
                                       power_arrays(own, sizes), std::move(by), gravity,
                                       book.tangents);
}

// Derivatives of a recorded window in eight lanes; ``laws`` by programs alone, ``data`` those of what enters; structural:
// the derived book and the lane of every number of the structure.
//
// Returns derivatives of the event rows (events, 12, 8), of samples at ``times`` (times, width, 8), of the energies of
// drives and weight, dampers, resistive and smooth forces, friction (5, 8) where ``powers`` are given (see power_slopes), and flags
// (flags, 3): event, reason, lane.
nb::tuple tangents_modal(Book& book, const Nodes& nodes, const Signals& signals, const Laws& laws,
                         const Settings& settings, nb::handle rows, nb::handle start, nb::handle data, nb::list structural,
                         nb::handle recorded, const Doubles& times, nb::tuple powers) {
  const Sizes& sizes = book.sizes;
  const size_t m = size_t(laws.feet);
  const Rows given(rows, signals, m * laws.columns, 2 * size_t(sizes.coordinates), m, sizes.drives);
  const WindowRecord window(start, recorded, sizes, m);
  const DataTangents tangents = data_tangents(data, size_t(sizes.coordinates), laws, signals, given.batch.profile);
  std::vector<Structural> numbers;
  for (nb::handle item : structural) {
    const auto [by, lane] = nb::cast<std::tuple<DerivedBook*, int>>(item);
    if (&by->book != &book || lane < 0 || lane >= LANES) throw std::invalid_argument("derivatives of the structure are those of its book");
    numbers.push_back({by, lane});
  }
  const auto sums = power_slopes(powers, nodes, book, given.batch.of(0), tangents);
  TangentResult result;
  {
    nb::gil_scoped_release released;
    result = derive_modal({book, nodes, signals, laws, settings, given.batch.channels}, given.batch.of(0), window.begun(), tangents, numbers,
                          window.record(), {times.data(), times.size()}, sums.get());
  }
  return nb::make_tuple(returned_rows(std::move(result.events)), returned_rows(std::move(result.samples)),
                        returned_rows(sums == nullptr ? std::vector<Row>() : std::vector<Row>(sums->sums, sums->sums + POWERS)),
                        returned_rows(std::move(result.flags)));
}

}  // namespace

void bind_window(nb::module_& m) {
  m.def("tangents_modal", &tangents_modal);
}

}  // namespace tarsus
