#include <nanobind/nanobind.h>

namespace tarsus {
void bind_plan(nanobind::module_&);
void bind_legged(nanobind::module_&);
}

NB_MODULE(_native, m) {
  tarsus::bind_plan(m);
  tarsus::bind_legged(m);
}
