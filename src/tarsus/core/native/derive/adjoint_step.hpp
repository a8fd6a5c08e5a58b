// The maps of whole recorded steps (record/replay.hpp) transposed: from what a number depends on after them to what it depends on
// before. What is added to is an Entering: derivatives of one number by the state, the nodal inputs and the sources of a step.
#pragma once
#include "record/replay.hpp"
#include "derive/run.hpp"

namespace tarsus::modal {

// What nodal inputs make of an output at the nodes (8), transposed.
TARSUS_INLINE Row input_back(const StepClass& step, int output, int input, const Row& by) {
  const double* rows = step.from_input(output, input);
  alignas(64) double out[N];
  for (int l = 0; l < N; l++) out[l] = total(load(rows + l * N) * by);
  return load(out);
}

// An output at the nodes by the state, the sources, and by some of the inputs.
inline void output_back(const StepClass& step, const int* inputs, size_t count, int output, const Row& by, Entering<double>& to) {
  const Sizes& s = step.sizes;
  for (int b = 0; b < s.stride; b++) {
    for (int d = 0; d < 2; d++) to.state[d * s.stride + b] += total(load(step.from_state(output) + (b * 2 + d) * N) * by);
  }
  for (size_t n = 0; n < count; n++) {
    store(to.input(inputs[n]), load(to.input(inputs[n])) + input_back(step, output, inputs[n], by));
  }
  for (int q = 0; q < s.sources(); q++) to.sources[q] += total(load(step.node_bias + (q * s.outputs + output) * N) * by);
}

inline double dot(const double* rows, const double* x, int size) {
  double sum = 0.0;
  for (int k = 0; k < size; k++) sum += rows[k] * x[k];
  return sum;
}

// end_of_step; ``by`` (state): of the state at the end, then of that at the start.
inline void end_back(const StepClass& step, const std::vector<int>& acting, double* by, Entering<double>& to) {
  const int size = step.sizes.state();
  for (int i : acting) {
    const double* rows = step.state_input + size_t(i) * N * size;
    for (int l = 0; l < N; l++) to.input(i)[l] += dot(rows + l * size, by, size);
  }
  for (int q = 0; q < step.sizes.sources(); q++) to.sources[q] += dot(step.state_bias + q * size, by, size);
  const int ns = step.sizes.stride;
  const double* e = step.exponential;
  for (int b = 0; b < ns; b++) {
    const double x = by[b], y = by[ns + b];
    by[b] = x * e[b] + y * e[2 * ns + b];
    by[ns + b] = x * e[ns + b] + y * e[3 * ns + b];
  }
}

// Drives, of a run's data; degrees (pieces): highest power of a piece that it or a derivative of it has, -1
// of channels that nothing moves.
class DrivesBack {
 public:
  DrivesBack(const Signals& s, const Nodes& nodes, const RunData& run, const std::vector<int64_t>& degrees)
      : signals_(s), nodes_(nodes), run_(run), degrees_(degrees) {}

  // Whether anything depends on the piece of a cursor, or on what follows it.
  bool moves(const Cursor& at) const { return degrees_[at.piece] >= 0; }

  // The value of channel c at a fixed time in the piece of a cursor.
  void value(int c, const Cursor& at, double time, double by, DataAdjoint& to) const {
    const int64_t p = at.piece;
    if (degrees_[p] < 0) return;
    const double a = signals_.start[p], length = signals_.end[p] - a;
    const double x = degrees_[p] == 0 ? 0.0 : 2.0 * (time - at.shift - a) / length - 1.0;
    const double* k = signals_.coef.data() + DEGREE * p;
    double u = 0.0, slope = 0.0, power = by;
    for (int n = int(degrees_[p]); n >= 0; n--) {
      slope = slope * x + u;
      u = u * x + k[n];
    }
    for (int n = 0; n <= degrees_[p]; n++, power *= x) to.coef[DEGREE * p + n] += power;
    if (slope == 0.0) return;
    const double moved = by * 2.0 / length * slope, part = 0.5 * (x + 1.0);
    edge(c, at, to.begin[p], moved * (part - 1.0), to);
    edge(c, at, to.end[p], -moved * part, to);
  }

  // Its values at the nodes of a step, as DriveTangents::fill takes them.
  void fill(int c, Cursor at, double t, double h, const double* by, DataAdjoint& to) const {
    const auto over = [&](int j, double from) {
      return from + nodes_.tau[j] * h > signals_.end[at.piece] - signals_.start[at.piece] && !signals_.sharp[at.piece];
    };
    double from = t - at.shift - signals_.start[at.piece];
    if (!over(N - 1, from) && degrees_[at.piece] == 0) {  // a level
      to.coef[DEGREE * at.piece] += total(load(by));
      return;
    }
    for (int j = 0; j < N; j++) {
      while (over(j, from)) {
        if (!Player::next_piece(at)) break;
        from = t - at.shift - signals_.start[at.piece];
      }
      value(c, at, t + nodes_.tau[j] * h, by[j], to);
    }
  }

  // The moment at which the piece of a cursor begins.
  void beginning(int c, const Cursor& at, double by, DataAdjoint& to) const { edge(c, at, to.begin[at.piece], by, to); }

 private:
  const Signals& signals_;
  const Nodes& nodes_;
  const RunData run_;
  const std::vector<int64_t>& degrees_;

  void edge(int c, const Cursor& at, double& own, double by, DataAdjoint& to) const {
    own += by;
    to.loops[run_.channels[c]] += by * double(at.turns);
  }
};

}  // namespace tarsus::modal
