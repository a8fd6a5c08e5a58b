// Legged robots in Python: bodies and step tables of legs.
#include "base/convert.hpp"
#include "legged/unpack.hpp"

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
}

}  // namespace tarsus
