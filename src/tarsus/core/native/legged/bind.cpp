// Legged robots: a whole batch in one call.
#include <nanobind/stl/tuple.h>

#include "base/convert.hpp"
#include "legged/run.hpp"
#include "legged/unpack.hpp"
#include "march/rows.hpp"

namespace tarsus {

using namespace legged;

namespace {

// One step's matrices, for tests: state (4, N), force and film (2, N, N), largest |u| under a constant one.
nb::tuple step_of(const LegTables& tables, int k, int kind) {
  const LegStep& step = tables.of(k, kind);
  const auto rows = [](const double* from, size_t count) {
    return returned(std::vector<double>(from, from + count * N), N);
  };
  return nb::make_tuple(rows(&step.state[0][0], 4), rows(&step.force[0][0][0], 2 * N),
                        rows(&step.film[0][0][0], 2 * N), step.reach_force, step.reach_film);
}

// Where a window starts: time, held, leaving and since of each foot (see Beginning); not given: a run from t = 0.
struct Start {
  std::tuple<double, Array<uint8_t>, Array<uint8_t>, Doubles> parts;
  bool given;

  Start(nb::object from, size_t feet) : given(!from.is_none()) {
    if (!given) return;
    parts = nb::cast<decltype(parts)>(from);
    const auto& [at, held, leaving, since] = parts;
    if (held.size() != feet || leaving.size() != feet || since.size() != feet) {
      throw std::invalid_argument("the sizes of a window's start and of its plan differ");
    }
  }
  Beginning begun() const {
    const auto& [at, held, leaving, since] = parts;
    return {at, held.data(), leaving.data(), since.data()};
  }
};

// Displacements and rates of every leg (legs, directions, 2), upward first, from where a robot has come to (2 n).
std::vector<double> legs_of(const Body& body, const std::vector<double>& state) {
  std::vector<double> out;
  for (int i = 0; i < int(body.legs.size()); i++) {
    for (int d = 0; d < body.directions; d++) {
      const size_t at = size_t(body.coordinate(i, d));
      out.insert(out.end(), {state[at], state[size_t(body.all_coordinates()) + at]});
    }
  }
  return out;
}

// Every run of a batch.
//
// Returns codes, events and where those of every run end, marks and where they end, finish (time, steps, rejected steps),
// samples, and of the last run body (2, nb), legs (nl, directions, 2), contacts and energies at its end. ``start``: where every run
// starts, as time, held, leaving and since of each foot (see Beginning); from t = 0 without it.
nb::tuple run_batch(const Body& body, const LegTables& tables, const Nodes& nodes, const Signals& signals, const Laws& laws,
                     nb::handle given, const Settings& settings, const Doubles& times, bool account,
                     nb::object start) {
  if (laws.feet != body.feet()) throw std::invalid_argument("the body and the laws are of different feet");
  const Rows rows(given, signals, size_t(laws.feet) * laws.columns, 2 * size_t(body.all_coordinates()), laws.feet, body.drives, body.shape());
  const Batch& batch = rows.batch;
  const Start begin(start, laws.flags.size());
  const std::vector<Beginning> starts(begin.given ? batch.runs : 0, begin.given ? begin.begun() : Beginning{});
  const std::vector<SampleTimes> asked(batch.runs, SampleTimes{times.data(), times.size()});
  LeggedResult out;
  {
    nb::gil_scoped_release released;
    out = run_legged({body, tables, nodes, signals, laws, settings, batch.channels}, batch.all(), starts, asked, account);
  }
  const size_t nb = size_t(body.coordinates()), n = size_t(body.all_coordinates());
  const std::vector<double> state(out.states.end() - long(2 * n), out.states.end());
  std::vector<double> moving(state.begin(), state.begin() + long(nb));
  moving.insert(moving.end(), state.begin() + long(n), state.begin() + long(n + nb));
  std::vector<int64_t> contacts;
  for (auto foot = out.feet.end() - body.feet(); foot != out.feet.end(); ++foot) contacts.push_back(int64_t(foot->contact));
  return nb::make_tuple(returned(std::move(out.codes)), returned_rows(std::move(out.events)), returned(std::move(out.event_end)),
                        returned(std::move(out.marks), out.mark_width), returned(std::move(out.mark_end)), returned(std::move(out.finish), 3),
                        returned(std::move(out.samples), out.sample_width), returned(std::move(moving), nb),
                        returned(legs_of(body, state), 2 * body.directions), returned(std::move(contacts)),
                        returned(std::vector<double>(out.energies.end() - long(out.energy_width), out.energies.end())));
}

}  // namespace

void bind_legged(nb::module_& m) {
  nb::class_<Body>(m, "LeggedBody").def("__init__", [](Body* out, nb::dict from) { new (out) Body(body_of(Given(std::move(from)))); });
  nb::class_<LegTables>(m, "LegTables")
      .def("__init__",
           [](LegTables* out, const Nodes& nodes, const Doubles& mass, const Doubles& stiffness,
              const Doubles& damping, const Doubles& lengths) {
             new (out) LegTables(nodes, copied(mass), copied(stiffness), copied(damping), copied(lengths));
           })
      .def("step", &step_of)
      .def_prop_ro("lengths", [](const LegTables& t) { return returned(std::vector<double>(t.lengths)); });
  m.def("run_legged", &run_batch, nb::arg("body"), nb::arg("tables"), nb::arg("nodes"), nb::arg("signals"), nb::arg("laws"),
        nb::arg("rows"), nb::arg("settings"), nb::arg("times"), nb::arg("account"), nb::arg("start") = nb::none());
}

}  // namespace tarsus
