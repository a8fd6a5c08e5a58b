#include <nanobind/nanobind.h>

#include "march/built.hpp"
#include "march/march.hpp"

namespace tarsus {
void bind_plan(nanobind::module_&);
void bind_program(nanobind::module_&);
void bind_modal(nanobind::module_&);
void bind_legged(nanobind::module_&);
void bind_advance(nanobind::module_&);
void bind_flights(nanobind::module_&);
void bind_packet(nanobind::module_&);
void bind_measure(nanobind::module_&);

// Raise what arrived in Python meanwhile (Ctrl-C); only its main thread receives signals.
static void raise_signals() {
  nanobind::gil_scoped_acquire python;
  if (PyErr_CheckSignals() != 0) throw nanobind::python_error();
}
}  // namespace tarsus

NB_MODULE(_native, m) {
  // The command line ends without searching for garbage: what is alive then goes with the process, and is no leak.
  nanobind::set_leak_warnings(false);
  m.attr("built") = tarsus::built();
  tarsus::give_way = tarsus::raise_signals;
  tarsus::bind_plan(m);
  tarsus::bind_program(m);
  tarsus::bind_modal(m);
  tarsus::bind_legged(m);
  tarsus::bind_advance(m);
  tarsus::bind_flights(m);
  tarsus::bind_packet(m);
  tarsus::bind_measure(m);
}
