// Samples of a run: the structure at given times, each by the step in which it lies.
#pragma once
#include "march/kinds.hpp"
#include "modal/land.hpp"
#include "modal/accepted.hpp"

namespace tarsus::modal {

// Numbers of a sample: displacements and velocities; gap [m], its rate [m/s] (a held foot has neither), force [N] of resistive and of
// smooth laws in the air, the structure's pull [N] on a held foot, contact (see march/kinds.hpp), of each foot; and friction [N] along
// the ground where feet know their way there.
inline size_t sample_width(const Sizes& s) { return 2 * size_t(s.coordinates) + 6 * size_t(s.feet) + size_t(s.ways); }

// Weights of nodal values in the value of their polynomial at scaled time s, and in its derivative there by s.
struct Weights {
  Row value = Row(1.0), slope = Row(0.0);

  Weights(const Nodes& nodes, double s) {
    Row sum = Row(0.0);
    for (int c = N - 1; c >= 0; c--) {
      slope = slope * s + sum;
      sum = sum * s + load(nodes.monomial[c]);
    }
    for (int k = 0; k < N; k++) {  // by Lagrange's polynomials, which round less than powers
      Row share = Row(s - nodes.tau[k]), apart = nodes.times() - nodes.tau[k];
      share.set(k, 1.0);
      apart.set(k, 1.0);
      value *= share / apart;
    }
  }
};

// S: how the modes lie in packs.
template <class S>
class Sampler {
 public:
  explicit Sampler(const Modal& of)
      : at_(of.book, of.nodes, of.player.signals, of.laws.laws, of.units, 0), whole_(at_.values), value_(at_.values.size()),
        slope_(at_.values.size()) {}

  void begin(const RunData& run) { at_.biases.take(run.sources); }

  // The structure at scaled time s of a step, as `sample_width` says.
  void sample(const AcceptedStep& step, double s, double* to) {
    const ContactMode& mode = *step.mode;
    const int m = at_.sizes.feet, n2 = 2 * at_.sizes.coordinates;
    const Weights weights(at_.nodes, s);
    std::fill(value_.begin(), value_.end(), 0.0);
    std::fill(slope_.begin(), slope_.end(), 0.0);
    for (int i : step.acting) {
      value_[i] = total(weights.value * step.inputs[i]);
      slope_[i] = total(weights.slope * step.inputs[i]) / step.tables->length;
    }
    move(step, s);
    for (int k : mode.stuck) at_.feet[k].place = value_[m + k];
    double* feet = to + n2;
    std::fill(feet, feet + 6 * m + at_.sizes.ways, 0.0);
    for (int i : mode.free) feet[GAP * m + i] = at_.gap_of(i);
    for (int i : mode.held) show_held(i, feet);
    for (int i : mode.free) at_.shift(mode.beta, i, value_[i]);
    for (int i : mode.free) {
      feet[RATE * m + i] = at_.rate_of(i);
      feet[RESISTIVE_FORCE * m + i] = slope_[i];
      feet[SMOOTH_FORCE * m + i] = value_[m + i];
    }
    find_physical(at_);
    std::copy(at_.physical.begin(), at_.physical.end(), to);
  }

 private:
  enum Column { GAP, RATE, RESISTIVE_FORCE, SMOOTH_FORCE, PULL, CONTACT, FRICTION_FORCE };

  Modal at_;  // the run at the moment
  std::vector<Row> whole_;
  std::vector<double> value_, slope_;  // of the inputs there, and their rates

  // Go to scaled time s of a step: it is halved until a Taylor polynomial resolves the rest.
  void move(const AcceptedStep& step, double s) {
    at_.set_mode(*step.mode);
    std::copy(step.state.begin(), step.state.end(), at_.state());
    at_.inputs = step.acting;
    at_.constant = step.constant;
    for (int i : at_.inputs) at_.values[i] = step.inputs[i];
    int k = step.tables->number;
    for (; at_.mode->terms[k] == 0 && k + 1 < at_.book.classes(); s = s >= 0.5 ? 2.0 * s - 1.0 : 2.0 * s) {
      k++;
      for (int i : at_.inputs) whole_[i] = at_.values[i];
      take_half(at_.nodes.left);
      if (s < 0.5) continue;
      flow<S>(at_, at_.take_class(k));
      at_.accept();
      take_half(at_.nodes.right);
    }
    const StepClass& last = at_.take_class(k);
    scale_inputs(at_, last);
    state_at<S>(at_, last, last.terms, s);
    at_.accept();
  }
  void take_half(const double (*matrix)[N]) {
    for (int i : at_.inputs) {
      for (int j = 0; j < N; j++) at_.values[i].set(j, total(load(matrix[j]) * whole_[i]));
    }
  }

  void show_held(int i, double* feet) const {
    const ContactMode& mode = *at_.mode;
    const int m = at_.sizes.feet, ni = at_.sizes.inputs();
    const auto pull = [&](int output) {
      double sum = at_.along(mode.outputs, output) + at_.bias->feed[output];
      for (int k : at_.inputs) sum += value_[k] * mode.feed[output * ni + k] + slope_[k] * mode.feed_rate[output * ni + k];
      return sum;
    };
    const bool slips = std::find(mode.sliding.begin(), mode.sliding.end(), i) != mode.sliding.end();
    feet[PULL * m + i] = pull(i);
    feet[CONTACT * m + i] = slips ? SLIPPING : STUCK;
    if (slips) feet[FRICTION_FORCE * m + i] = value_[m + i];
    if (mode.is_stuck[i]) feet[FRICTION_FORCE * m + i] = -pull(m + i);
  }
};

}  // namespace tarsus::modal
