// Samples of recorded steps: the state of a structure at given times.
#pragma once
#include "march/kinds.hpp"
#include "record/replay.hpp"

namespace tarsus::modal {

// The recorded step (of ``rows`` of them) that a moment lies in: the last one that begins by then, and the scaled time.
struct Place {
  size_t row;
  double s;
};

inline Place place_of(const double* trace, size_t width, size_t rows, double time) {
  size_t low = 0, high = rows;
  while (high - low > 1) {
    const size_t middle = (low + high) / 2;
    (trace[middle * width] <= time ? low : high) = middle;
  }
  const double* row = trace + low * width;
  return {low, std::min(std::max((time - row[0]) / row[1], 0.0), row[2])};
}

// Samples (times, sample_width) of recorded steps.
inline std::vector<double> sample_steps(Book& book, const Nodes& nodes, const double* sources,
                                        const double* trace, size_t rows, const double* times, size_t count) {
  const Sizes& sizes = book.sizes;
  const size_t width = recorded_width(sizes);
  std::vector<double> out(count * sample_width(sizes)), state;
  Recording recording(book, trace);
  Entering entering(sizes);
  Inside room(sizes);
  Shown shown(sizes);
  std::vector<int> acting;
  size_t last = rows;
  for (size_t n = 0; rows > 0 && n < count; n++) {
    const Place at = place_of(trace, width, rows, times[n]);
    const Recorded step = recording.step(at.row);
    if (at.row != last) {
      enter_recorded(step, sources, entering);
      acting.clear();
      for (int i = 0; i < sizes.last(); i++) {
        if (std::any_of(entering.input(i), entering.input(i) + N, [](double x) { return x != 0.0; })) acting.push_back(i);
      }
      last = at.row;
    }
    within_step(book, nodes, *step.mode, step.step_class, at.s, acting, entering, room, state);
    show(*step.mode, nodes, step.length, at.s, acting, entering, state, shown);
    double* to = out.data() + n * sample_width(sizes);
    to = std::copy(shown.place.begin(), shown.place.end(), to);
    for (const auto* part : {&shown.gap, &shown.rate, &shown.resistive, &shown.smooth, &shown.pull}) {
      to = std::copy(part->begin(), part->end(), to);
    }
    for (int i = 0; i < sizes.feet; i++) *to++ = step.mode->is_held[i] ? STUCK : AIR;
    for (int i : step.mode->sliding) *(to - sizes.feet + i) = SLIPPING;
    std::copy_n(shown.friction.begin(), sizes.ways, to);
  }
  return out;
}

}  // namespace tarsus::modal
