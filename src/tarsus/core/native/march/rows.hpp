// The runs of a batch from Python: arrays with a row a run (see tarsus.rows), checked and read in place.
#pragma once
#include "march/batch.hpp"
#include "base/convert.hpp"
#include "drives/signals.hpp"

namespace tarsus {

// Keeps the arrays while a batch runs.
struct Rows {
  Doubles parameters, initial, sources, scales, profile;
  Integers channels;
  Batch batch;

  static constexpr size_t NOT_READ = size_t(-1);

  // ``columns``: numbers of the laws' parameters of one run at least; states: displacements and velocities of one run; shape: numbers of
  // the ground's profile of one run, or NOT_READ.
  Rows(nb::handle rows, const Signals& signals, size_t columns, size_t states, size_t feet, size_t drives, size_t shape = 0)
      : parameters(nb::cast<Doubles>(rows.attr("parameters"))), initial(nb::cast<Doubles>(rows.attr("initial"))),
        sources(nb::cast<Doubles>(rows.attr("sources"))), scales(nb::cast<Doubles>(rows.attr("scales"))),
        profile(nb::cast<Doubles>(rows.attr("profile"))), channels(nb::cast<Integers>(rows.attr("channels"))) {
    const size_t runs = initial.shape(0), width = runs ? channels.size() / runs : 0;
    const size_t given = runs ? parameters.size() / runs : 0;
    const bool fits = runs > 0 && initial.size() == runs * states && given >= columns && parameters.size() == runs * given &&
                      sources.size() == runs * (feet + GRAVITIES) && scales.size() == runs * 3 && width >= drives &&
                      channels.size() == runs * width && (shape == NOT_READ || profile.size() == runs * shape);
    if (!fits) throw std::invalid_argument("the sizes of a plan and of the rows of its runs differ");
    for (size_t c = 0; c < channels.size(); c++) {
      if (channels.data()[c] < 0 || channels.data()[c] >= signals.channels()) throw std::invalid_argument("no such channel");
    }
    batch = {{parameters.data(), initial.data(), sources.data(), scales.data(), channels.data(), profile.data()},
             runs, given, states, feet + GRAVITIES, width, shape == NOT_READ ? 0 : shape};
  }
};

}  // namespace tarsus
