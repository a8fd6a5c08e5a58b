#include <nanobind/nanobind.h>

namespace tarsus {
void bind_plan(nanobind::module_&);
}

NB_MODULE(_native, m) { tarsus::bind_plan(m); }
