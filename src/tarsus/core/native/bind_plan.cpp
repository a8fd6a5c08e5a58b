// What runs share, as Python objects: nodes, signals, laws, settings.
#include "convert.hpp"
#include "kinds.hpp"
#include "laws.hpp"
#include "march.hpp"
#include "signals.hpp"

namespace tarsus {

namespace {

Nodes nodes_of(nb::handle module) {
  Nodes nodes;
  copy_to(nodes.tau, N, module, "TAU");
  copy_to(&nodes.monomial[0][0], N * N, module, "MONOMIAL");
  for (int j = 0; j < N; j++) {
    for (int c = 0; c < N; c++) nodes.from_value[j][c] = nodes.monomial[c][j];
  }
  copy_to(nodes.tail, N, module, "TAIL");
  copy_to(&nodes.derivative[0][0], N * N, module, "DERIVATIVE");
  copy_to(&nodes.once[0][0], N * N, module, "ONCE");
  copy_to(&nodes.twice[0][0], N * N, module, "TWICE");
  return nodes;
}

Signals signals_of(nb::handle group) {
  Signals out;
  out.first = field<int64_t>(group, "first");
  out.loop = field<int64_t>(group, "loop");
  out.start = field<double>(group, "start");
  out.end = field<double>(group, "end");
  out.coef = field<double>(group, "coef");
  out.until = field<double>(group, "until");
  out.over = field<double>(group, "over");
  out.period = field<double>(group, "period");
  out.span = field<double>(group, "span");
  out.flat = booleans(group, "flat");
  out.sharp = booleans(group, "sharp");
  return out;
}

void make_laws(Laws* out, const Integers& flags, const Integers& volts, int columns, nb::list terms, nb::list programs) {
  new (out) Laws();
  out->feet = int(flags.size());
  out->columns = columns;
  out->flags = copied(flags);
  out->volts = copied(volts);
  for (nb::handle item : programs) {
    const auto code = field<int32_t>(item, "code");
    const auto constants = field<double>(item, "constants");
    out->programs.push_back(link(code.data(), int(code.size() / 4), constants.data(), int(constants.size()),
                                 nb::cast<int>(item.attr("arguments")), nb::cast<int>(item.attr("parameters"))));
  }
  for (nb::handle item : terms) {
    const auto term = nb::cast<nb::tuple>(item);  // hook, twin, program, first column
    out->add(nb::cast<int>(term[0]), {nb::cast<int>(term[1]), nb::cast<int>(term[2]), nb::cast<int>(term[3])});
  }
}

}  // namespace

void bind_plan(nb::module_& m) {
  nb::class_<Nodes>(m, "Nodes").def("__init__", [](Nodes* out, nb::handle source) { new (out) Nodes(nodes_of(source)); });
  nb::class_<Signals>(m, "Signals").def("__init__", [](Signals* out, nb::handle group) { new (out) Signals(signals_of(group)); });
  nb::class_<Laws>(m, "Laws").def("__init__", &make_laws);
  nb::class_<Settings>(m, "Settings")
      .def(nb::init<>())
      .def_rw("end", &Settings::end)
      .def_rw("period", &Settings::period)
      .def_rw("gap", &Settings::gap)
      .def_rw("drive", &Settings::drive)
      .def_rw("gap_zero", &Settings::gap_zero)
      .def_rw("force_zero", &Settings::force_zero)
      .def_rw("speed_zero", &Settings::speed_zero)
      .def_rw("rest_height", &Settings::rest_height)
      .def_rw("least_progress", &Settings::least_progress)
      .def_rw("probe", &Settings::probe)
      .def_rw("most_steps", &Settings::most_steps)
      .def_rw("first_class", &Settings::first_class)
      .def_rw("track", &Settings::track)
      .def_rw("record", &Settings::record);
  m.attr("HOOKS") = nb::make_tuple("momentum", "force", "rebound", "strength", "friction", "excess");
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
