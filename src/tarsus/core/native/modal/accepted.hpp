// An accepted step of a run, for its observer: what entered the step, from which every moment of it follows.
#pragma once
#include "modal/state.hpp"

namespace tarsus::modal {

// Momenta of films count from the start of the step: else a small motion would be a difference of large numbers.
struct AcceptedStep {
  const ContactMode* mode = nullptr;
  const StepClass* tables = nullptr;
  double begun = 0.0, ended = 0.0, fraction = 0.0;  // times [s]; scaled time at which it ended
  std::vector<double> state;                        // at its start (2 stride)
  std::vector<Row> inputs;                          // at its nodes, by number
  std::vector<int> acting;                          // those that may differ from zero, but for the constant one
  std::vector<uint8_t> constant;                    // which do not change in the step

  explicit AcceptedStep(const Sizes& s) : state(s.state()), inputs(s.inputs(), Row(0.0)) { inputs[s.last()] = Row(1.0); }

  // The step that a run has just accepted.
  void take(Modal& m, const StepClass& of, double from, double part) {
    mode = m.mode;
    tables = &of;
    constant = m.constant;
    begun = from;
    ended = m.clock.time;
    fraction = part;
    std::copy_n(m.ahead(), state.size(), state.begin());
    for (int i : acting) inputs[i] = Row(0.0);
    acting = m.inputs;
    for (int i : acting) inputs[i] = m.values[i];
    for (int i : mode->free) {
      const double first = inputs[i][0];
      if (first == 0.0) continue;
      inputs[i] -= first;
      for (size_t k = 0; k < state.size(); k++) state[k] += mode->beta[i * state.size() + k] * first;
    }
  }
};

}  // namespace tarsus::modal
