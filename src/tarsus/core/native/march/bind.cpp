// What runs share, as Python objects: nodes, signals, laws, settings.
#include "base/convert.hpp"
#include "march/kinds.hpp"
#include "laws/laws.hpp"
#include "march/march.hpp"
#include "drives/pieces.hpp"

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

// Channels laid end to end: count, loop (nc,); start of each and its end (sum of count + 1), coef (sum, 12), kink (sum,).
void make_signals(Signals* out, const Integers& count, const Integers& loop, const Doubles& start, const Doubles& coef,
                  const Array<bool>& kink) {
  new (out) Signals();
  size_t pieces = 0;
  for (size_t c = 0; c < count.size(); c++) pieces += size_t(count.data()[c]);
  if (loop.size() != count.size() || start.size() != pieces + count.size() || coef.size() != DEGREE * pieces ||
      kink.size() != pieces) {
    throw std::invalid_argument("the sizes of the pieces of a drive differ");
  }
  const double *from = start.data(), *rows = coef.data();
  const bool* sharp = kink.data();
  for (size_t c = 0; c < count.size(); c++) {
    const int64_t n = count.data()[c];
    if (n < 1 || loop.data()[c] >= n) throw std::invalid_argument("a drive has a piece at least, and its loop begins with one");
    add_channel(*out, {n, loop.data()[c], from, rows, sharp});
    from += n + 1;
    rows += DEGREE * n;
    sharp += n;
  }
  if (out->first.empty()) out->first.push_back(0);
}

template <class T>
nb::object shown(const std::vector<T>& values) {
  return returned(std::vector<T>(values));
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
  nb::class_<Signals>(m, "Signals")
      .def("__init__", &make_signals)
      .def_prop_ro("first", [](const Signals& s) { return shown(s.first); })
      .def_prop_ro("loop", [](const Signals& s) { return shown(s.loop); })
      .def_prop_ro("start", [](const Signals& s) { return shown(s.start); })
      .def_prop_ro("end", [](const Signals& s) { return shown(s.end); })
      .def_prop_ro("coef", [](const Signals& s) { return returned(std::vector<double>(s.coef), DEGREE); })
      .def_prop_ro("until", [](const Signals& s) { return shown(s.until); })
      .def_prop_ro("over", [](const Signals& s) { return shown(s.over); })
      .def_prop_ro("period", [](const Signals& s) { return shown(s.period); })
      .def_prop_ro("span", [](const Signals& s) { return shown(s.span); })
      .def_prop_ro("flat", [](const Signals& s) { return shown(s.flat); })
      .def_prop_ro("sharp", [](const Signals& s) { return shown(s.sharp); });
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
      .def_rw("least_flight", &Settings::least_flight)
      .def_rw("least_progress", &Settings::least_progress)
      .def_rw("probe", &Settings::probe)
      .def_rw("most_steps", &Settings::most_steps)
      .def_rw("first_class", &Settings::first_class)
      .def_rw("track", &Settings::track)
      .def_rw("record", &Settings::record);
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
