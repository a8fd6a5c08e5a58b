// Free flights in Python.
#include "base/convert.hpp"
#include "flights/flights.hpp"

namespace tarsus {

using namespace flights;

namespace {

Structure structure_of(nb::handle from, const Doubles& output) {
  Structure out;
  out.flow = field<double>(from, "flow");
  out.inputs = field<double>(from, "inputs");
  out.row = field<double>(from, "row");
  out.free = field<double>(from, "free");
  out.first = field<double>(from, "first");
  out.last = field<double>(from, "last");
  out.output = copied(output);
  out.states = int(2 * out.row.size());
  out.channels = int(out.output.size()) / out.states;
  const size_t n = size_t(out.states);
  if (out.flow.size() != n * n || out.free.size() != n * n || out.inputs.size() != 2 * n || out.first.size() != 2 * n ||
      out.last.size() != 2 * n || out.output.size() != size_t(out.channels) * n) {
    throw std::invalid_argument("the sizes of a structure's maps differ");
  }
  return out;
}

// A column of numbers with eight derivatives each.
struct Column {
  Doubles value, slope;
  Column(nb::handle from, const char* name, size_t size)
      : value(nb::cast<Doubles>(from.attr(name))), slope(nb::cast<Doubles>(from.attr((std::string(name) + "_slopes").c_str()))) {
    if (value.size() != size || slope.size() != size * N) throw std::invalid_argument(std::string(name) + " has a wrong size");
  }
  Number at(size_t n) const { return {value.data()[n], load(slope.data() + n * N)}; }
};

// Flights of a structure (its maps, `tarsus.solve.flights`): launch has numbers of each flight, with derivatives; near (flights,
// nk): the drive's force before its first sample, near_step [s] apart; drive, and squares where there are any (flights, steps +
// 1): at the ends of the steps; counts (flights,): samples of each, every so many steps.
//
// Returns values (samples, channels) of all flights one after the other, and their derivatives (samples, 8 channels).
nb::tuple fly(nb::handle maps, double step, const Doubles& output, nb::handle launch, const Doubles& near, double near_step,
              const Doubles& drive, const Doubles& squares, const Integers& counts, int every) {
  const Structure structure = structure_of(maps, output);
  const size_t flights = counts.size(), states = size_t(structure.states), channels = size_t(structure.channels);
  const Column state(launch, "state", flights * states), begin(launch, "begin", flights), offset(launch, "offset", 2 * flights);
  const Column film(launch, "film", 5 * flights);
  const Doubles neutral = nb::cast<Doubles>(launch.attr("neutral"));
  const size_t steps = flights == 0 ? 0 : drive.size() / flights, table = flights == 0 ? 0 : near.size() / flights;
  size_t total = 0;
  for (size_t r = 0; r < flights; r++) {
    const int64_t count = counts.data()[r];
    if (count < 1 || size_t(count - 1) * size_t(every) + 1 > steps) throw std::invalid_argument("a flight is longer than its drive");
    total += size_t(count);
  }
  if (drive.size() != steps * flights || near.size() != table * flights || (flights > 0 && table < 2) || neutral.size() != flights ||
      (squares.size() != 0 && squares.size() != drive.size())) {
    throw std::invalid_argument("the sizes of the flights differ");
  }
  std::vector<double> values(total * channels), slopes(total * channels * N);
  {
    nb::gil_scoped_release released;
    Flight flight(structure);
    size_t done = 0;
    for (size_t r = 0; r < flights; r++) {
      const int count = int(counts.data()[r]);
      Foot foot;
      for (size_t p = 0; p < 5; p++) foot.film[p] = film.at(5 * r + p);
      foot.raised = foot.film[4].value != 3.0 || highest(magnitude(foot.film[4].slope)) > 0.0;
      foot.neutral = neutral.data()[r];
      const Number offsets[2] = {offset.at(2 * r), offset.at(2 * r + 1)}, late = begin.at(r);
      for (size_t i = 0; i < states; i++) flight.state()[i] = state.at(states * r + i);
      if (late.value != 0.0 || highest(magnitude(late.slope)) > 0.0) flight.approach(foot, late, near.data() + table * r, int(table), near_step, offsets);
      const double* volts = squares.size() == 0 ? nullptr : squares.data() + steps * r;
      flight.fly(foot, drive.data() + steps * r, volts, step, offsets, count, every, values.data() + done * channels,
                 slopes.data() + done * channels * N);
      done += size_t(count);
    }
  }
  return nb::make_tuple(returned(std::move(values), channels), returned(std::move(slopes), channels * N));
}

}  // namespace

void bind_flights(nb::module_& m) { m.def("fly", &fly); }

}  // namespace tarsus
