// Derivatives of a run's data from Python.
#pragma once
#include "convert.hpp"
#include "modal_replay.hpp"
#include "tangent.hpp"

namespace tarsus {

typedef Array<uint8_t> Flags;

inline modal::Halves halves_of(nb::handle module) {
  modal::Halves out;
  copy_to(&out.left[0][0], N * N, module, "LEFT");
  copy_to(&out.right[0][0], N * N, module, "RIGHT");
  return out;
}

// Rows of eight lanes from an array (..., 8).
inline std::vector<Row> lanes(nb::handle group, const char* name, size_t count) {
  const auto array = nb::cast<Doubles>(group.attr(name));
  if (array.size() != count * LANES) throw std::invalid_argument(std::string(name) + " has a wrong size");
  std::vector<Row> out;
  for (size_t n = 0; n < count; n++) out.push_back(load(array.data() + n * LANES));
  return out;
}

// coordinates: of the structure.
inline DataTangents data_tangents(nb::handle from, size_t coordinates, const Laws& laws, const Signals& signals, size_t channels) {
  const size_t m = size_t(laws.feet), pieces = signals.start.size();
  DataTangents out;
  out.parameters = lanes(from, "parameters", m * laws.columns);
  out.initial = lanes(from, "initial", 2 * coordinates);
  out.sources = lanes(from, "sources", m + 1);
  out.since = lanes(from, "since", m);
  out.coef = lanes(from, "coef", pieces * DEGREE);
  out.begin = lanes(from, "begin", pieces);
  out.end = lanes(from, "end", pieces);
  out.loops = lanes(from, "loops", size_t(signals.channels()));
  out.changes = lanes(from, "changes", 3 * channels);
  out.period = lanes(from, "period", 1)[0];
  return out;
}

}  // namespace tarsus
