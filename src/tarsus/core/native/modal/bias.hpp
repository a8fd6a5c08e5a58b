// The effect of rest gaps and gravity on a structure: the constant part of its motion, combined once a run from tables per unit.
//
// Tables are made per unit of each source (rest gaps of the feet, gravity), so that runs that differ in them share the tables.
// The combination for a contact mode and for a step of it is made when a run first needs it, and kept until the data change.
#pragma once
#include "modal/tables.hpp"

namespace tarsus::modal {

// What is added over one step.
struct BiasStep {
  uint64_t made = 0;
  double *node = nullptr, *state = nullptr;  // (outputs, 8): outputs at the nodes; (state): state at the end
  std::vector<Row> memory;
};

// What is added in one contact mode.
struct BiasMode {
  uint64_t made = 0;
  // inputs (state), direct parts of outputs (2 feet), place (2 n), direct parts of pulls (feet), and (constraints, MARKOV)
  double *inputs = nullptr, *feed = nullptr, *offset = nullptr, *held = nullptr, *printed = nullptr, *markov = nullptr;
  std::vector<BiasStep> steps;
  std::vector<Row> memory;
};

class Bias {
 public:
  Bias(const Sizes& sizes, int classes) : sizes_(sizes), classes_(classes), values_(sizes.sources(), NOT_A_NUMBER) {}

  // Take the data of a run: rest gaps [m], gravity [m/s^2].
  void take(const double* values) {
    if (std::equal(values_.begin(), values_.end(), values)) return;
    values_.assign(values, values + sizes_.sources());
    stamp_++;
  }

  BiasMode& of(const ContactMode& mode) {
    while (int(modes_.size()) <= mode.number) modes_.push_back(std::make_unique<BiasMode>());
    BiasMode& out = *modes_[mode.number];
    if (out.made != stamp_) make(mode, out);
    return out;
  }

  TARSUS_INLINE const BiasStep& of(BiasMode& mode, const StepClass& step) {
    BiasStep& out = mode.steps[step.number];
    if (__builtin_expect(out.made != stamp_, 0)) make(step, out);
    return out;
  }

 private:
  const Sizes sizes_;
  int classes_;
  uint64_t stamp_ = 0;
  std::vector<double> values_;
  std::vector<std::unique_ptr<BiasMode>> modes_;  // by number

  void combine_units(double* to, const double* units, int count) const {
    for (int n = 0; n < count; n++) {
      double sum = 0.0;
      for (int s = 0; s < sizes_.sources(); s++) sum += values_[s] * units[s * count + n];
      to[n] = sum;
    }
  }

  TARSUS_APART void make(const ContactMode& mode, BiasMode& out) {
    const int m = sizes_.feet;
    if (out.memory.empty()) {
      out.steps.resize(classes_);
      lay_out(out.memory, {{&out.inputs, size_t(sizes_.state())}, {&out.feed, 2 * size_t(m)},
                           {&out.offset, 2 * size_t(sizes_.coordinates)}, {&out.held, size_t(m)}, {&out.printed, size_t(m)},
                           {&out.markov, size_t(sizes_.constraints()) * MARKOV}});
    }
    combine_units(out.inputs, mode.bias_inputs, sizes_.state());
    combine_units(out.feed, mode.bias_feed, 2 * m);
    combine_units(out.offset, mode.bias_offset, 2 * sizes_.coordinates);
    combine_units(out.held, mode.bias_held, m);
    combine_units(out.printed, mode.bias_printed, m);
    combine_units(out.markov, mode.bias_markov, sizes_.constraints() * MARKOV);
    out.made = stamp_;
  }

  TARSUS_APART void make(const StepClass& step, BiasStep& out) {
    if (out.memory.empty()) {
      lay_out(out.memory, {{&out.node, size_t(sizes_.outputs) * N}, {&out.state, size_t(sizes_.state())}});
    }
    combine_units(out.node, step.node_bias, sizes_.outputs * N);
    combine_units(out.state, step.state_bias, sizes_.state());
    out.made = stamp_;
  }
};

}  // namespace tarsus::modal
