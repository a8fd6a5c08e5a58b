// Robots that go on from where they are, each to a time of its own, in Python.
#include <nanobind/stl/tuple.h>

#include "base/convert.hpp"
#include "legged/run.hpp"
#include "march/rows.hpp"
#include "modal/run.hpp"

namespace tarsus {

namespace {

// Where robots are and how far each goes: at, until (runs) [s]; feet (runs, feet, CARRIED), not read where a robot begins.
struct Ways {
  Doubles at, until, feet;
  size_t m;

  Ways(nb::handle from, size_t runs, size_t many) : m(many) {
    std::tie(at, until, feet) = nb::cast<std::tuple<Doubles, Doubles, Doubles>>(from);
    if (at.size() != runs || until.size() != runs || feet.size() != runs * m * CARRIED) {
      throw std::invalid_argument("the sizes of robots and of their feet differ");
    }
  }
  std::vector<Beginning> all() const {
    const auto* carried = reinterpret_cast<const CarriedFoot*>(feet.data());
    std::vector<Beginning> out;
    for (size_t run = 0; run < at.size(); run++) {
      out.push_back({at.data()[run], nullptr, nullptr, nullptr, until.data()[run], m > 0 ? carried + run * m : nullptr});
    }
    return out;
  }
};

// What they come to: codes; finish (runs, 3): time [s], steps, rejected steps; states (runs, 2 n); what feet carry on; events and where
// those of each end.
struct Parts {
  std::vector<int64_t> codes, event_end;
  std::vector<double> finish, states;
  std::vector<CarriedFoot> feet;
  std::vector<Event> events;

  // More of each than this is what they are accounted by.
  nb::tuple returned_as(size_t width, nb::object first, nb::object second) {
    return nb::make_tuple(returned(std::move(codes)), returned(std::move(finish), 3), returned(std::move(states), width),
                          returned_rows(std::move(feet)), returned_rows(std::move(events)), returned(std::move(event_end)), first, second);
  }
};

// Returns, after what all do (see Parts), recorded steps where the settings ask for them and where those of each robot end.
nb::tuple advance_modal(modal::Book& book, const Nodes& nodes, const Signals& signals, const Laws& laws, const Settings& settings,
                        nb::handle rows, nb::handle ways) {
  const size_t m = size_t(laws.feet), width = 2 * size_t(book.sizes.coordinates);
  if (laws.feet != book.sizes.feet) throw std::invalid_argument("the book and the laws are of different feet");
  const Rows given(rows, signals, m * laws.columns, width, m, book.sizes.drives);
  const Ways on(ways, given.batch.runs, m);
  modal::ModalResult made;
  {
    nb::gil_scoped_release released;
    made = modal::run_modal({book, nodes, signals, laws, settings, given.batch.channels}, given.batch.all(), on.all());
  }
  Parts out{std::move(made.codes), std::move(made.event_end), std::move(made.finish), std::move(made.states), std::move(made.feet), std::move(made.events)};
  return out.returned_as(width, returned(std::move(made.trace), modal::recorded_width(book.sizes)), returned(std::move(made.trace_end)));
}

// Returns, after what all do (see Parts), energies (runs, .) where they are to be integrated, and nothing.
nb::tuple advance_legged(const legged::Body& body, const legged::LegTables& tables, const Nodes& nodes, const Signals& signals,
                         const Laws& laws, const Settings& settings, nb::handle rows, nb::handle ways, bool account) {
  if (laws.feet != body.feet()) throw std::invalid_argument("the body and the laws are of different feet");
  const size_t m = size_t(laws.feet), width = 2 * size_t(body.all_coordinates());
  const Rows given(rows, signals, m * laws.columns, width, m, body.drives, body.shape());
  const Ways on(ways, given.batch.runs, m);
  legged::LeggedResult made;
  {
    nb::gil_scoped_release released;
    made = legged::run_legged({body, tables, nodes, signals, laws, settings, given.batch.channels}, given.batch.all(), on.all(), {}, account);
  }
  Parts out{std::move(made.codes), std::move(made.event_end), std::move(made.finish), std::move(made.states), std::move(made.feet), std::move(made.events)};
  return out.returned_as(width, returned(std::move(made.energies), made.energy_width), nb::none());
}

}  // namespace

void bind_parts(nb::module_& m) {
  m.def("advance_modal", &advance_modal);
  m.def("advance_legged", &advance_legged);
  m.attr("CARRIED") = CARRIED;
}

}  // namespace tarsus
