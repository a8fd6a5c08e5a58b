#include <nanobind/nanobind.h>

namespace tarsus {
void bind_program(nanobind::module_& m);
}

NB_MODULE(_native, m) {
  m.attr("lanes") = 8;
  tarsus::bind_program(m);
}
