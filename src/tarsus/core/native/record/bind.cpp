// Recorded steps in Python: samples of them, and where their energy went.
#include "base/convert.hpp"
#include "march/rows.hpp"
#include "record/energies.hpp"
#include "record/samples.hpp"

namespace tarsus {

using namespace modal;

namespace {

size_t steps_of(const Book& book, const Doubles& sources, const Doubles& trace) {
  const size_t width = recorded_width(book.sizes);
  if (sources.size() != size_t(book.sizes.sources()) || trace.size() % width != 0) {
    throw std::invalid_argument("the sizes of a plan and of its recorded steps differ");
  }
  return trace.size() / width;
}

nb::object sample_modal(Book& book, const Nodes& nodes, const Doubles& sources, const Doubles& trace,
                        const Doubles& times) {
  const size_t steps = steps_of(book, sources, trace);
  std::vector<double> out;
  {
    nb::gil_scoped_release released;
    out = sample_steps(book, nodes, sources.data(), trace.data(), steps, times.data(), times.size());
  }
  return returned(std::move(out), sample_width(book.sizes));
}

// Energies up to the end of each recorded step (see EnergySums). carriers: damping (n, n), normals (m, n), loads (nd, n), constant
// forces (n), tangents (ways, n); acting: signals, laws and the row of the run, or None: then any drive may move, and laws have no
// shares.
nb::tuple energies_modal(Book& book, const Nodes& nodes, nb::handle carriers, const Doubles& sources,
                         const Doubles& trace, nb::handle acting) {
  const Sizes& s = book.sizes;
  const size_t steps = steps_of(book, sources, trace), n = s.coordinates;
  const auto given = nb::cast<nb::tuple>(carriers);
  const auto part = [&](int i) { return copied(nb::cast<Doubles>(given[i])); };
  const Carriers by{part(0), part(1), part(2), part(3), part(4)};
  if (by.damping.size() != n * n || by.normals.size() != s.feet * n || by.loads.size() != s.drives * n || by.constant.size() != n ||
      by.tangents.size() != s.ways * n) {
    throw std::invalid_argument("the sizes of a structure and of its book differ");
  }
  std::unique_ptr<Rows> rows;
  std::unique_ptr<LawShares> shares;
  if (!acting.is_none()) {
    const auto of = nb::cast<nb::tuple>(acting);
    const Signals& signals = nb::cast<const Signals&>(of[0]);
    const Laws& laws = nb::cast<const Laws&>(of[1]);
    rows = std::make_unique<Rows>(of[2], signals, size_t(s.feet) * laws.columns, 2 * n, s.feet, s.drives);
    shares = std::make_unique<LawShares>(s, nodes, signals, laws, rows->batch.of(0), rows->batch.channels);
  }
  EnergySums out;
  {
    nb::gil_scoped_release released;
    out = energies_of(book, Legendre(nodes), by, sources.data(), trace.data(), steps, shares.get());
  }
  return nb::make_tuple(returned(std::move(out.rows), 1 + ENERGIES + (shares ? shares->count() : 0)), returned(std::move(out.swing)));
}

}  // namespace

void bind_record(nb::module_& m) {
  m.def("sample_modal", &sample_modal);
  m.def("energies_modal", &energies_modal, nb::arg("book"), nb::arg("nodes"), nb::arg("carriers"), nb::arg("sources"), nb::arg("trace"), nb::arg("acting").none());
}

}  // namespace tarsus
