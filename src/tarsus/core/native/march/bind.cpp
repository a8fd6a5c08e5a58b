// What runs share, as Python objects: nodes, signals, laws, settings.
#include "base/convert.hpp"
#include "march/kinds.hpp"
#include "march/rows.hpp"
#include "march/start.hpp"
#include "march/unpack.hpp"

namespace tarsus {

namespace {

// Initial states (runs, 2 n), of walkers that stand as they do, and scales (runs, 3) of their own; and why the first run that cannot
// start does not, a row a reason: run, fault, foot, by (see Refusal). idle (runs, drives): forces [N] without volts.
nb::tuple start_rows(const StartRules& rules, const Laws& laws, const Signals& signals, nb::handle rows, const Doubles& idle) {
  const Rows given(rows, signals, size_t(laws.feet) * laws.columns, 2 * rules.n, rules.m, rules.drives, Rows::NOT_READ);
  if (idle.size() != given.batch.runs * rules.drives) throw std::invalid_argument("the sizes of runs and of their drives differ");
  std::vector<double> initial = copied(given.initial), scales = copied(given.scales);
  std::vector<Refusal> refused;
  ActingLaws acting(laws);
  for (size_t run = 0; run < given.batch.runs && refused.empty(); run++) {
    const RunData own = given.batch.of(run);
    set_up(rules, acting, signals, {own.parameters, own.sources, idle.data() + run * rules.drives, own.channels, &initial[run * 2 * rules.n], &scales[run * 3]},
           double(run), refused);
  }
  return nb::make_tuple(returned(std::move(initial), 2 * rules.n), returned(std::move(scales), 3), returned_rows(std::move(refused)));
}

template <class Made, Made (*Make)(const Fields&)>
void make(Made* out, nb::dict from) {
  new (out) Made(Make(Given(std::move(from))));
}

}  // namespace

void bind_plan(nb::module_& m) {
  nb::class_<Nodes>(m, "Nodes").def("__init__", &make<Nodes, nodes_of>);
  nb::class_<Signals>(m, "Signals").def("__init__", &make<Signals, signals_of>);
  nb::class_<Laws>(m, "Laws").def("__init__", &make<Laws, laws_of>);
  nb::class_<Settings>(m, "Settings").def("__init__", &make<Settings, settings_of>);
  nb::class_<StartRules>(m, "StartRules").def("__init__", [](StartRules* out, nb::dict from) { new (out) StartRules(Given(std::move(from))); });
  m.def("start_rows", &start_rows);
  m.attr("FAULTS") = nb::make_tuple("below the ground", "pulled down", "unbalanced");
  m.attr("HOOKS") = nb::make_tuple("momentum", "force", "rebound", "strength", "friction", "excess", "remaining");
  nb::dict flags;  // by hook, where a law there is to be known of a foot; and what else is
  flags["momentum"] = int(HAS_MOMENTUM);
  flags["force"] = int(HAS_FORCE);
  flags["strength"] = int(HAS_LATCH);
  flags["excess"] = int(RESTITUTES_FIRST);
  flags["uses_rate"] = int(USES_RATE);
  flags["map_as_is"] = int(MAP_AS_IS);
  flags["pull_as_printed"] = int(PULL_AS_PRINTED);
  m.attr("FLAGS") = flags;
  nb::dict twins;
  twins["Film.momentum"] = int(FILM_MOMENTUM);
  twins["Electrostatic.force"] = int(ELECTROSTATIC_FORCE);
  twins["LegElectrostatic.force"] = int(LEG_ELECTROSTATIC_FORCE);
  twins["Restitution.rebound"] = int(RESTITUTION_REBOUND);
  twins["Adhesion.strength"] = int(ADHESION_STRENGTH);
  twins["Friction.bound"] = int(FRICTION_BOUND);
  twins["AdhesiveFriction.bound"] = int(ADHESIVE_FRICTION_BOUND);
  twins["RestituteFirst.excess"] = int(RESTITUTE_FIRST_EXCESS);
  m.attr("TWINS") = twins;
}

}  // namespace tarsus
