// Replay of the recorded steps of a run: outputs at the nodes of a step, its end, and any moment inside it.
//
// All of it is linear in what enters a step: its start state, its nodal inputs, the sources (rest gaps, gravity).
#pragma once
#include "laws/laws.hpp"
#include "modal/tables.hpp"

namespace tarsus::modal {

// A recorded step; ``state`` (2 blocks), ``inputs`` (inputs, 8).
struct Recorded {
  double time, length, fraction;
  const ContactMode* mode;
  int step_class;
  const double *state, *inputs;
};

// Recorded steps one after the other; each contact mode is looked up once.
class Recording {
 public:
  Recording(Book& book, const double* trace) : book_(book), trace_(trace), width_(recorded_width(book.sizes)) {}

  const double* row(size_t r) const { return trace_ + r * width_; }
  Recorded step(size_t r) {
    const double* at = row(r);
    const size_t q = size_t(at[3]);
    if (q >= modes_.size()) modes_.resize(q + 1, nullptr);
    if (modes_[q] == nullptr) modes_[q] = &book_.numbered(int(q));
    const double* state = at + TRACE_HEAD;
    return {at[0], at[1], at[2], modes_[q], int(at[4]), state, state + 2 * book_.sizes.coordinates};
  }

 private:
  Book& book_;
  const double* trace_;
  size_t width_;
  std::vector<const ContactMode*> modes_;
};

// Weights of the nodal values of a step in the value at its scaled time s, and in the derivatives there by s.
struct Weights {
  Row value = Row(0.0), slope = Row(0.0), bend = Row(0.0);

  Weights(const Nodes& nodes, double s) {
    for (int c = N - 1; c >= 0; c--) {
      bend = bend * s + slope * 2.0;
      slope = slope * s + value;
      value = value * s + load(nodes.monomial[c]);
    }
    value = Row(1.0);  // by Lagrange's polynomials, which round less than powers
    for (int k = 0; k < N; k++) {
      Row share = Row(s - nodes.tau[k]), apart = nodes.times() - nodes.tau[k];
      share.set(k, 1.0);
      apart.set(k, 1.0);
      value *= share / apart;
    }
  }
};

// sum_j weights[j] values[j]
TARSUS_INLINE double weighted(const Row& weights, const double* values) {
  double even = values[0] * weights[0], odd = values[1] * weights[1];
  for (int j = 2; j < N; j += 2) {
    even += values[j] * weights[j];
    odd += values[j + 1] * weights[j + 1];
  }
  return even + odd;
}

// What enters a step: start state, inputs, sources; from these follow the inputs' values at any moment of it.
struct Entering {
  std::vector<double> state, inputs, sources;  // (2 stride), (inputs, 8), (feet + 2)

  explicit Entering(const Sizes& s)
      : state(s.state(), 0.0), inputs(size_t(s.inputs()) * N, 0.0), sources(s.sources(), 0.0) {}

  const double* input(int i) const { return inputs.data() + N * i; }
  double* input(int i) { return inputs.data() + N * i; }
};

// The state of a recorded step with momenta counted from its start, or a small motion would be a difference of large numbers.
inline void enter_recorded(const Recorded& r, const double* sources, Entering& to) {
  const Sizes& s = r.mode->sizes;
  const int nb = r.mode->blocks_used, ns = s.stride;
  std::fill(to.state.begin(), to.state.end(), 0.0);
  std::copy(r.state, r.state + nb, to.state.begin());
  std::copy(r.state + nb, r.state + 2 * nb, to.state.begin() + ns);
  std::copy(r.inputs, r.inputs + to.inputs.size(), to.inputs.begin());
  to.sources.assign(sources, sources + s.sources());
  for (int i : r.mode->free) {
    const double first = to.input(i)[0];
    if (first == 0.0) continue;
    for (int j = 0; j < N; j++) to.input(i)[j] -= first;
    for (int k = 0; k < s.state(); k++) to.state[k] += r.mode->beta[i * s.state() + k] * first;
  }
}

// rows (count) . x
TARSUS_INLINE double dot(const double* rows, const std::vector<double>& x) {
  double sum = 0.0;
  for (size_t k = 0; k < x.size(); k++) sum += x[k] * rows[k];
  return sum;
}

// An output at the nodes of a step; ``acting``: inputs that may differ from zero.
TARSUS_INLINE Row output_row(const StepClass& step, const std::vector<int>& acting, const Entering& from, int output) {
  const Sizes& s = step.sizes;
  const double* rows = step.from_state(output);
  Row even = Row(0.0), odd = Row(0.0);
  for (int b = 0; b < s.stride; b++) {
    even += load(rows + b * 2 * N) * from.state[b];
    odd += load(rows + (b * 2 + 1) * N) * from.state[s.stride + b];
  }
  for (int i : acting) {
    const double *effect = step.from_input(output, i), *value = from.input(i);
    for (int l = 0; l < N; l += 2) {
      even += load(effect + l * N) * value[l];
      odd += load(effect + (l + 1) * N) * value[l + 1];
    }
  }
  for (int q = 0; q < s.sources(); q++) even += load(step.node_bias + (q * s.outputs + output) * N) * from.sources[q];
  return even + odd;
}

// The state at the end of a whole step.
inline void end_of_step(const StepClass& step, const std::vector<int>& acting, const Entering& from,
                        std::vector<double>& to) {
  const int ns = step.sizes.stride, size = 2 * ns;
  const double* e = step.exponential;
  to.assign(size, 0.0);
  for (int b = 0; b < ns; b++) {
    to[b] = from.state[b] * e[b] + from.state[ns + b] * e[ns + b];
    to[ns + b] = from.state[b] * e[2 * ns + b] + from.state[ns + b] * e[3 * ns + b];
  }
  for (int i : acting) {
    const double* rows = step.state_input + size_t(i) * N * size;
    for (int l = 0; l < N; l++) {
      const double x = from.input(i)[l];
      for (int k = 0; k < size; k++) to[k] += x * rows[l * size + k];
    }
  }
  for (int q = 0; q < step.sizes.sources(); q++) {
    const double* rows = step.state_bias + q * size;
    for (int k = 0; k < size; k++) to[k] += from.sources[q] * rows[k];
  }
}

// Work space for the state at a moment inside a step.
struct Inside {
  Entering part, left;
  std::vector<double> middle, term;

  explicit Inside(const Sizes& s) : part(s), left(s) {}
};

// The half of a step that holds its moment s, in place of the whole one in ``room.part``; s becomes that of the half.
inline void halve(const StepClass& half, const Nodes& nodes, const std::vector<int>& acting, Inside& room, double& s) {
  const auto on = [](const double (*matrix)[N], const double* from, double* to) {
    for (int j = 0; j < N; j++) to[j] = weighted(load(matrix[j]), from);
  };
  for (int i : acting) on(nodes.left, room.part.input(i), room.left.input(i));
  const bool late = s >= 0.5;
  if (late) {
    room.left.state = room.part.state;
    room.left.sources = room.part.sources;
    end_of_step(half, acting, room.left, room.middle);
    room.part.state.swap(room.middle);
    for (int i : acting) on(nodes.right, room.part.input(i), room.left.input(i));
  }
  for (int i : acting) std::copy_n(room.left.input(i), N, room.part.input(i));
  s = late ? 2.0 * s - 1.0 : 2.0 * s;
}

// The state at scaled time s of a step of class k: the step is halved until a Taylor polynomial resolves the rest.
inline void within_step(Book& book, const Nodes& nodes, const ContactMode& mode, int k, double s,
                        const std::vector<int>& acting, const Entering& whole, Inside& room, std::vector<double>& to) {
  const int ns = mode.sizes.stride, size = 2 * ns;
  const Entering* from = &whole;
  while (mode.terms[k] == 0 && k + 1 < book.classes()) {
    k++;
    if (from == &whole) {
      room.part.state = whole.state;
      room.part.sources = whole.sources;
      for (int i : acting) std::copy_n(whole.input(i), N, room.part.input(i));
      from = &room.part;
    }
    halve(book.step(mode, k), nodes, acting, room, s);
  }
  const double span = s * book.lengths[k], *t = mode.blocks;
  std::vector<double>& term = room.term;
  to = term = from->state;
  double power = 1.0;
  for (int c = 0; c < N; c++, power *= s) {  // while inputs come in
    const double by = span / (c + 1);
    for (int b = 0; b < ns; b++) {
      const double x = term[b] * by, y = term[ns + b] * by;
      term[b] = x * t[b] + y * t[ns + b];
      term[ns + b] = x * t[2 * ns + b] + y * t[3 * ns + b];
    }
    for (int i : acting) {
      const double value = weighted(load(nodes.monomial[c]) * (power * by), from->input(i));
      for (int r = 0; r < size; r++) term[r] += value * mode.inputs[i * size + r];
    }
    for (int q = 0; c == 0 && q < mode.sizes.sources(); q++) {
      for (int r = 0; r < size; r++) term[r] += from->sources[q] * (mode.bias_inputs[q * size + r] * by);
    }
    for (int r = 0; r < size; r++) to[r] += term[r];
  }
  const int rest = std::max(mode.terms[k] - N, 2);  // then powers of T alone
  for (int b = 0; b < ns; b++) {
    double sum[4] = {}, factor = 1.0;
    for (int c = 1; c <= rest; c++) {
      factor *= span * mode.rate / (N + c);
      for (int e = 0; e < 4; e++) sum[e] += factor * mode.powers[(4 * c + e) * ns + b];
    }
    to[b] += term[b] * sum[0] + term[ns + b] * sum[1];
    to[ns + b] += term[b] * sum[2] + term[ns + b] * sum[3];
  }
}

// The structure at one moment: displacements and velocities (2 n); of each foot gap [m], its rate [m/s] (a held foot
// has neither), the force [N] of resistive and of smooth laws in the air, the structure's pull [N] on a held foot, and friction [N]
// along the ground.
struct Shown {
  std::vector<double> place, gap, rate, resistive, smooth, pull, friction;
  std::vector<double> modal, value, slope;  // from which the others follow: the modal state; the inputs, and their rates

  explicit Shown(const Sizes& s)
      : place(2 * s.coordinates, 0.0), gap(s.feet, 0.0), rate(gap), resistive(gap), smooth(gap), pull(gap),
        friction(gap), modal(s.state(), 0.0), value(s.inputs(), 0.0), slope(value) {}
};

// Room for one moment: displacements and velocities; gap, rate, resistive and smooth force, pull, contact (see march/kinds.hpp), of
// each foot; and friction where feet know their way along the ground.
inline size_t sample_width(const Sizes& s) { return 2 * size_t(s.coordinates) + 6 * size_t(s.feet) + size_t(s.ways); }

// The constant parts of a contact mode's rows under these sources.
TARSUS_INLINE double with_sources(const std::vector<double>& sources, const double* unit, int count, int row) {
  double sum = 0.0;
  for (size_t q = 0; q < sources.size(); q++) sum += sources[q] * unit[q * count + row];
  return sum;
}

// Its feet alone.
inline void show_feet(const ContactMode& mode, const Nodes& nodes, double length, double s, const std::vector<int>& acting,
                      const Entering& from, const std::vector<double>& state, Shown& to) {
  const Sizes& size = mode.sizes;
  const int m = size.feet, ni = size.inputs();
  const Weights weights(nodes, s);
  const Row rates = weights.slope * (1.0 / length);
  to.modal = state;
  std::fill(to.value.begin(), to.value.end(), 0.0);
  std::fill(to.slope.begin(), to.slope.end(), 0.0);
  for (int i : acting) {
    to.value[i] = weighted(weights.value, from.input(i));
    to.slope[i] = weighted(rates, from.input(i));
    if (i >= m) continue;
    for (size_t k = 0; k < state.size(); k++) to.modal[k] += to.value[i] * mode.beta[i * state.size() + k];
  }
  for (int i = 0; i < m; i++) {
    to.gap[i] = to.rate[i] = to.resistive[i] = to.smooth[i] = to.pull[i] = to.friction[i] = 0.0;
    const double along = dot(mode.outputs + size_t(i) * size.state(), state) + with_sources(from.sources, mode.bias_feed, 2 * m, i);
    if (!mode.is_held[i]) {
      to.gap[i] = along;
      for (int k : mode.stuck) to.gap[i] += to.value[m + k] * mode.feed[i * ni + m + k];
      to.rate[i] = dot(mode.outputs + size_t(m + i) * size.state(), to.modal);
      to.resistive[i] = to.slope[i];
      to.smooth[i] = to.value[m + i];
      continue;
    }
    const auto with_inputs = [&](double sum, int o) {
      for (int k : acting) sum += to.value[k] * mode.feed[o * ni + k] + to.slope[k] * mode.feed_rate[o * ni + k];
      return sum;
    };
    to.pull[i] = with_inputs(along, i);
    if (mode.is_stuck[i]) {
      const double pulled = dot(mode.outputs + size_t(m + i) * size.state(), state) + with_sources(from.sources, mode.bias_feed, 2 * m, m + i);
      to.friction[i] = -with_inputs(pulled, m + i);
    }
  }
  for (int i : mode.sliding) to.friction[i] = to.value[m + i];
}

inline void show(const ContactMode& mode, const Nodes& nodes, double length, double s, const std::vector<int>& acting,
                 const Entering& from, const std::vector<double>& state, Shown& to) {
  const int n2 = 2 * mode.sizes.coordinates;
  show_feet(mode, nodes, length, s, acting, from, state, to);
  for (int r = 0; r < n2; r++) {
    to.place[r] = dot(mode.to_physical + size_t(r) * state.size(), to.modal) + with_sources(from.sources, mode.bias_offset, n2, r);
  }
  for (int k : mode.stuck) {
    for (int r = 0; r < n2 / 2; r++) to.place[r] += to.value[mode.sizes.feet + k] * mode.placed[k * (n2 / 2) + r];
  }
}

// Inputs that act in a contact mode: momenta and smooth forces of the free feet, where laws have them, and drives; friction on feet
// that slide, and the places of those that stick.
inline std::vector<int> acting_inputs(const ContactMode& mode, const ActingLaws& laws) {
  std::vector<int> out;
  for (int i : mode.free) {
    if (laws.has(i, HAS_MOMENTUM)) out.push_back(i);
  }
  for (int i : mode.free) {
    if (laws.has(i, HAS_FORCE)) out.push_back(mode.sizes.feet + i);
  }
  for (int i = 2 * mode.sizes.feet; i < mode.sizes.last(); i++) out.push_back(i);
  for (int i : mode.sliding) out.push_back(mode.sizes.feet + i);
  for (int i : mode.stuck) out.push_back(mode.sizes.feet + i);
  return out;
}

}  // namespace tarsus::modal
