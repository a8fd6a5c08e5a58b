// Legged robots: a whole batch in one call.
#include <nanobind/stl/tuple.h>

#include "derive/convert.hpp"
#include "derive/legged_tangent.hpp"
#include "legged/unpack.hpp"
#include "legged/window.hpp"
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

struct Ends {
  std::vector<int64_t> codes, event_end, mark_end;
  std::vector<double> finish;
};

// What runs leave.
struct Outcome {
  Ends ends;
  Log log;
  Notes notes;
  std::vector<double> moving, legs, energies;
  std::vector<int64_t> contacts;
  size_t sample_width = 0;
};

void run_all(LeggedMarch& system, const Batch& batch, const Start& begin, Outcome& out) {
  const Body& body = system.body;
  const int nb = body.coordinates();
  out.sample_width = system.sample_width();
  out.notes.samples.assign(out.notes.times.size() * out.sample_width, NOT_A_NUMBER);
  for (size_t run = 0; run < batch.runs; run++) {
    system.begin(batch.of(run));
    if (begin.given) begin_at(system, begin.begun());
    out.ends.codes.push_back(march(system));
    out.ends.event_end.push_back(int64_t(out.log.events.size()));
    out.ends.mark_end.push_back(int64_t(out.notes.marks.size()) / (3 + nb + 2 * body.feet()));
    out.ends.finish.insert(out.ends.finish.end(),
                           {system.clock.time, double(system.clock.steps), double(system.clock.rejected)});
  }
  system.rebase();  // so that the rates are those of the feet
  out.moving.assign(system.x, system.x + nb);
  out.moving.insert(out.moving.end(), system.v, system.v + nb);
  for (const LeggedFoot& foot : system.feet) {
    double u[DIRECTIONS] = {foot.u[UP], foot.u[ALONG]}, w[DIRECTIONS] = {foot.w[UP], foot.w[ALONG]};
    const int i = int(&foot - system.feet.data());
    in_world(system, i, u);
    in_world(system, i, w);
    out.legs.insert(out.legs.end(), {u[UP], w[UP], u[ALONG], w[ALONG]});
    if (body.directions > DIRECTIONS) out.legs.insert(out.legs.end(), {foot.u[ACROSS], foot.w[ACROSS]});
  }
  for (int i : body.leg) out.contacts.push_back(system.feet[i].contact);
  out.energies.assign(&system.energy.work, &system.energy.work + ENERGIES);
  out.energies.insert(out.energies.end(), system.shares.begin(), system.shares.end());
}

// Every run of a batch.
//
// Returns codes, events and where those of every run end, marks and where they end, finish (time, steps, rejected steps),
// samples, and of the last run body (2, nb), legs (nl, directions, 2), contacts and energies at its end. ``start``: where every run
// starts, as time, held, leaving and since of each foot (see Beginning); from t = 0 without it.
nb::tuple run_legged(const Body& body, const LegTables& tables, const Nodes& nodes, const Signals& signals, const Laws& laws,
                     nb::handle given, const Settings& settings, const Doubles& times, bool account,
                     nb::object start) {
  const int nb = body.coordinates();
  if (laws.feet != body.feet()) throw std::invalid_argument("the body and the laws are of different feet");
  const Rows rows(given, signals, size_t(laws.feet) * laws.columns, 2 * size_t(body.all_coordinates()), laws.feet, body.drives, body.shape());
  const Batch& batch = rows.batch;
  const Start begin(start, laws.flags.size());
  Outcome out;
  out.notes.times = copied(times);
  {
    nb::gil_scoped_release released;
    const Between between(nodes);
    LeggedMarch system(body, tables, nodes, between, signals, laws, settings, out.log, out.notes, account, batch.channels);
    run_all(system, batch, begin, out);
  }
  return nb::make_tuple(returned(std::move(out.ends.codes)), returned_rows(std::move(out.log.events)),
                        returned(std::move(out.ends.event_end)),
                        returned(std::move(out.notes.marks), 3 + nb + 2 * body.feet()),
                        returned(std::move(out.ends.mark_end)), returned(std::move(out.ends.finish), 3),
                        returned(std::move(out.notes.samples), out.sample_width), returned(std::move(out.moving), nb),
                        returned(std::move(out.legs), 2 * body.directions), returned(std::move(out.contacts)),
                        returned(std::move(out.energies)));
}

// Derivatives of one run in eight lanes, of which the first ``count`` have a number; ``programs``: the laws by programs alone;
// ``data``: derivatives of what enters; copies: bodies and tables of perturbed structures, each with its weight in the
// difference of a lane; the rest as for run_legged.
//
// Returns of event rows (events, 12, 8), marks (marks, width, 8), samples (times, width, 8), begins of contacts (feet, 8) and
// energies (5, 8) at the end, and flags (flags, 3): event, reason, lane.
nb::tuple tangents_legged(const Body& body, const LegTables& tables, const Nodes& nodes, const Signals& signals, const Laws& laws,
                          const Laws& programs, nb::handle given, const Settings& settings, const Doubles& times, bool account,
                          nb::object start, nb::handle data, int count, nb::list copies) {
  const size_t coordinates = body.coordinates() + 2 * body.legs.size(), m = size_t(laws.feet);
  const Rows rows(given, signals, m * laws.columns, 2 * coordinates, m, body.drives, body.shape());
  const Start begin(start, m);
  const DataTangents tangents = data_tangents(data, coordinates, laws, signals, rows.batch.profile);
  std::vector<PerturbedBody> others;
  for (nb::handle item : copies) {
    const auto [other, legs, weight, lane] = nb::cast<std::tuple<Body*, LegTables*, double, int>>(item);
    if (other->legs.size() != body.legs.size() || legs->lengths != tables.lengths || lane < 0 || lane >= count) {
      throw std::invalid_argument("perturbed copies of a walker have its legs and steps");
    }
    others.push_back({other, legs, weight, lane});
  }
  LeggedSlopes found;
  std::vector<Row> events;
  std::vector<TangentFlag> flags;
  Notes notes;
  Log log;
  notes.times = copied(times);
  {
    nb::gil_scoped_release released;
    const Between between(nodes);
    LeggedTangent system(body, tables, nodes, between, signals, laws, programs, settings, log, notes, account, rows.batch.channels,
                         rows.batch.of(0), tangents, count, others);
    notes.samples.assign(notes.times.size() * system.sample_width(), NOT_A_NUMBER);
    system.begin(rows.batch.of(0));
    if (begin.given) begin_at(system, begin.begun());
    system.begin_lanes(begin.given);
    march(system);
    system.finish();
    found = std::move(system.slopes);
    events = std::move(system.reported.events);
    flags = std::move(system.reported.flags);
  }
  return nb::make_tuple(returned_rows(std::move(events)), returned_rows(std::move(found.marks)),
                        returned_rows(std::move(found.samples)), returned_rows(std::move(found.since)),
                        returned_rows(std::move(found.energies)), returned_rows(std::move(flags)));
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
  m.def("run_legged", &run_legged, nb::arg("body"), nb::arg("tables"), nb::arg("nodes"), nb::arg("signals"), nb::arg("laws"),
        nb::arg("rows"), nb::arg("settings"), nb::arg("times"), nb::arg("account"), nb::arg("start") = nb::none());
  m.def("tangents_legged", &tangents_legged, nb::arg("body"), nb::arg("tables"), nb::arg("nodes"), nb::arg("signals"),
        nb::arg("laws"), nb::arg("programs"), nb::arg("rows"), nb::arg("settings"), nb::arg("times"), nb::arg("account"),
        nb::arg("start").none(), nb::arg("data"), nb::arg("count"), nb::arg("copies"));
}

}  // namespace tarsus
