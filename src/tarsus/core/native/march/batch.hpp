// The runs of a batch: what differs from run to run of one plan, a row a run.
#pragma once
#include <cstddef>
#include <cstdint>
#include <vector>

#include "drives/signals.hpp"

namespace tarsus {

constexpr int GRAVITIES = 2;  // components of gravity: into the ground, and back along the way

// The data of one run.
struct RunData {
  const double* parameters;  // (feet, columns) of the laws
  const double* initial;     // displacements and velocities (2 n)
  const double* sources;     // rest gaps of the feet [m], gravity [m/s^2]: into the ground, and back along it
  const double* scales;      // length [m] and force [N] that tolerances refer to, period of the marks [s]
  const int64_t* channels;   // numbers of the signals that drive it
  const double* profile = nullptr;  // points of uneven ground (., 2) [m]: along the way, and height
};

// Of all runs; widths: numbers of one run.
struct Batch {
  RunData first;
  size_t runs, parameters, initial, sources, channels, profile = 0;

  RunData of(size_t run) const {
    return {first.parameters + run * parameters, first.initial + run * initial,   first.sources + run * sources,
            first.scales + run * 3,              first.channels + run * channels,
            profile > 0 ? first.profile + run * profile : nullptr};
  }
  std::vector<RunData> all() const {
    std::vector<RunData> out;
    for (size_t run = 0; run < runs; run++) out.push_back(of(run));
    return out;
  }
};

}  // namespace tarsus
