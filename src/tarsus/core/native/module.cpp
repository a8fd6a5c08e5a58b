#include <nanobind/nanobind.h>

#include "built.hpp"

NB_MODULE(_native, m) {
  m.attr("lanes") = 8;
  m.attr("built") = tarsus::built();
}
