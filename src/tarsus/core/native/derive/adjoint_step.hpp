// The maps of recorded steps (record/replay.hpp) transposed: from what a number depends on after them to what it depends on
// before. What is added to is an Entering: derivatives of one number by the state, the nodal inputs and the sources of a step.
#pragma once
#include "record/replay.hpp"
#include "derive/tangent.hpp"

namespace tarsus::modal {

// Derivatives of one number by the data of a run, sizes as in DataTangents; those by the laws' parameters are by groups of
// parameters that move together.
struct DataAdjoint {
  std::vector<double> groups, initial, sources, coef, begin, end, loops, changes;
  double period = 0.0;
};

// The tables of a step (StepClass), transposed. A head is what enters a step beside its inputs: its state and the sources, in
// so many rows.
class BackTables {
 public:
  const Sizes& sizes;
  const int head;  // rows of it

  BackTables(const StepClass& step)
      : sizes(step.sizes), head((sizes.state() + sizes.sources() + N - 1) / N), inputs_(size_t(sizes.outputs) * sizes.inputs() * N),
        heads_(size_t(sizes.outputs) * N * head, Row(0.0)), ends_(size_t(sizes.inputs()) * sizes.state()),
        end_heads_(size_t(sizes.state()) * head, Row(0.0)) {
    const int ni = sizes.inputs(), ns = sizes.stride, st = sizes.state();
    for (int o = 0; o < sizes.outputs; o++) {
      for (int i = 0; i < ni; i++) {
        for (int j = 0; j < N; j++) {
          for (int l = 0; l < N; l++) inputs_[(size_t(o) * ni + i) * N + j].set(l, step.from_input(o, i)[l * N + j]);
        }
      }
      for (int j = 0; j < N; j++) {
        double* to = at(heads_, o * N + j);
        for (int b = 0; b < ns; b++) {
          for (int d = 0; d < 2; d++) to[d * ns + b] = step.from_state(o)[(b * 2 + d) * N + j];
        }
        for (int q = 0; q < sizes.sources(); q++) to[st + q] = step.node_bias[(size_t(q) * sizes.outputs + o) * N + j];
      }
    }
    for (int k = 0; k < st; k++) {
      for (int i = 0; i < ni; i++) {
        for (int l = 0; l < N; l++) ends_[size_t(i) * st + k].set(l, step.state_input[(size_t(i) * N + l) * st + k]);
      }
      double* to = at(end_heads_, k);
      const int b = k % ns, d = k / ns;
      to[b] = step.exponential[2 * d * ns + b];
      to[ns + b] = step.exponential[(2 * d + 1) * ns + b];
      for (int q = 0; q < sizes.sources(); q++) to[st + q] = step.state_bias[q * st + k];
    }
  }

  // Of nodal inputs by what they add to an output.
  TARSUS_INLINE Row input(int output, int input, const double* by) const {
    const Row* rows = &inputs_[(size_t(output) * sizes.inputs() + input) * N];
    Row even = rows[0] * by[0], odd = rows[1] * by[1];
    for (int j = 2; j < N; j += 2) {
      even += rows[j] * by[j];
      odd += rows[j + 1] * by[j + 1];
    }
    return even + odd;
  }

  // Of a head by an output.
  TARSUS_INLINE void output(int output, const double* by, Row* to) const {
    const Row* rows = &heads_[size_t(output) * N * head];
    for (int j = 0; j < N; j++) {
      for (int w = 0; w < head; w++) to[w] += rows[j * head + w] * by[j];
    }
  }

  // Of nodal inputs, and of a head, by the state at the end of the whole step.
  TARSUS_INLINE Row end_input(int input, const double* by) const {
    Row sum = Row(0.0);
    for (int k = 0; k < sizes.state(); k++) sum += ends_[size_t(input) * sizes.state() + k] * by[k];
    return sum;
  }
  TARSUS_INLINE void end(const double* by, Row* to) const {
    for (int k = 0; k < sizes.state(); k++) {
      for (int w = 0; w < head; w++) to[w] += end_heads_[k * head + w] * by[k];
    }
  }

 private:
  std::vector<Row> inputs_, heads_, ends_, end_heads_;

  double* at(std::vector<Row>& rows, int place) { return reinterpret_cast<double*>(rows.data() + size_t(place) * head); }
};

inline double dot(const double* rows, const double* x, int size) {
  double sum = 0.0;
  for (int k = 0; k < size; k++) sum += rows[k] * x[k];
  return sum;
}

// by <- e^T by, for the exponentials or rates e (4, stride) of blocks.
inline void blocks_back(const double* e, int ns, double factor, double* by) {
  for (int b = 0; b < ns; b++) {
    const double x = by[b], y = by[ns + b];
    by[b] = factor * (x * e[b] + y * e[2 * ns + b]);
    by[ns + b] = factor * (x * e[ns + b] + y * e[3 * ns + b]);
  }
}

// end_of_step; ``by`` (state): of the state at the end, then of that at the start.
inline void end_back(const StepClass& step, const std::vector<int>& acting, double* by, Entering<double>& to) {
  const int size = step.sizes.state();
  for (int i : acting) {
    const double* rows = step.state_input + size_t(i) * N * size;
    for (int l = 0; l < N; l++) to.input(i)[l] += dot(rows + l * size, by, size);
  }
  for (int q = 0; q < step.sizes.sources(); q++) to.sources[q] += dot(step.state_bias + q * size, by, size);
  blocks_back(step.exponential, step.sizes.stride, 1.0, by);
}

// within_step's polynomial; ``part``: of what enters the half in which it is used.
inline void taylor_back(const Book& book, const Nodes& nodes, const ContactMode& mode, int k, double s, const std::vector<int>& acting,
                        const double* by, Entering<double>& part) {
  const int ns = mode.sizes.stride, size = 2 * ns, rest = std::max(mode.terms[k] - N, 2);
  const double span = s * book.lengths[k];
  std::vector<double>& term = part.state;
  for (int b = 0; b < ns; b++) {
    double sum[4] = {}, factor = 1.0;
    for (int c = 1; c <= rest; c++) {
      factor *= span * mode.rate / (N + c);
      for (int e = 0; e < 4; e++) sum[e] += factor * mode.powers[(4 * c + e) * ns + b];
    }
    term[b] = by[b] + by[b] * sum[0] + by[ns + b] * sum[2];
    term[ns + b] = by[ns + b] + by[b] * sum[1] + by[ns + b] * sum[3];
  }
  double power[N] = {1.0};
  for (int c = 1; c < N; c++) power[c] = power[c - 1] * s;
  for (int c = N - 1; c >= 0; c--) {
    const double share = span / (c + 1);
    for (int i : acting) {
      const double moved = dot(mode.inputs + i * size, term.data(), size) * (power[c] * share);
      store(part.input(i), load(part.input(i)) + load(nodes.monomial[c]) * moved);
    }
    for (int q = 0; c == 0 && q < mode.sizes.sources(); q++) {
      part.sources[q] += share * dot(mode.bias_inputs + q * size, term.data(), size);
    }
    blocks_back(mode.blocks, ns, share, term.data());
    for (int r = 0; r < size; r++) term[r] += by[r];
  }
}

// within_step; by (state): of the state at s, then of that at the start.
inline void within_back(Book& book, const Nodes& nodes, const Halves& halves, const ContactMode& mode, int k, double s,
                        const std::vector<int>& acting, Inside<double>& room, std::vector<double>& by, Entering<double>& to) {
  Entering<double>&part = room.part, &left = room.left;
  const int first = k;
  uint64_t late = 0;
  while (mode.terms[k] == 0 && k + 1 < book.classes()) {
    k++;
    if (s >= 0.5) late |= uint64_t(1) << (k - first);
    s = s >= 0.5 ? 2.0 * s - 1.0 : 2.0 * s;
  }
  for (int i : acting) std::fill_n(part.input(i), N, 0.0);
  std::fill(part.sources.begin(), part.sources.end(), 0.0);
  taylor_back(book, nodes, mode, k, s, acting, by.data(), part);
  const auto on = [](const double (*matrix)[N], const double* from, Row sum) {
    for (int j = 0; j < N; j++) sum += load(matrix[j]) * from[j];
    return sum;
  };
  for (; k > first; k--) {
    const bool second = late >> (k - first) & 1;
    if (second) {
      for (int i : acting) std::fill_n(left.input(i), N, 0.0);
      std::fill(left.sources.begin(), left.sources.end(), 0.0);
      end_back(book.step(mode, k), acting, part.state.data(), left);
      for (size_t q = 0; q < left.sources.size(); q++) part.sources[q] += left.sources[q];
    }
    for (int i : acting) {
      Row sum = on(second ? halves.right : halves.left, part.input(i), Row(0.0));
      if (second) sum = on(halves.left, left.input(i), sum);
      store(part.input(i), sum);
    }
  }
  by = part.state;
  for (int i : acting) store(to.input(i), load(to.input(i)) + load(part.input(i)));
  for (size_t q = 0; q < part.sources.size(); q++) to.sources[q] += part.sources[q];
}

// show at scaled time s; ``by``: of what is shown; state (state): that of the state there is added to.
inline void show_back(const ContactMode& mode, const Nodes& nodes, double length, double s, const std::vector<int>& acting,
                      const Shown<double>& by, std::vector<double>& state, Entering<double>& to) {
  const Sizes& size = mode.sizes;
  const int m = size.feet, ni = size.inputs(), st = size.state(), n2 = 2 * size.coordinates;
  const Weights weights(nodes, s);
  const Row rates = weights.slope * (1.0 / length);
  std::vector<double> modal(st, 0.0);
  const auto add = [st](std::vector<double>& sum, const double* rows, double factor) {
    for (int k = 0; k < st; k++) sum[k] += rows[k] * factor;
  };
  const auto put = [&](int i, double value, double slope) {
    store(to.input(i), load(to.input(i)) + weights.value * value + rates * slope);
  };
  for (int r = 0; r < n2; r++) {
    if (by.place[r] == 0.0) continue;
    add(modal, mode.to_physical + size_t(r) * st, by.place[r]);
    for (size_t q = 0; q < to.sources.size(); q++) to.sources[q] += by.place[r] * mode.bias_offset[q * n2 + r];
  }
  for (int i = 0; i < m; i++) {
    const double direct = mode.is_held[i] ? by.pull[i] : by.gap[i];
    if (direct != 0.0) {
      add(state, mode.outputs + size_t(i) * st, direct);
      for (size_t q = 0; q < to.sources.size(); q++) to.sources[q] += direct * mode.bias_feed[q * 2 * m + i];
    }
    if (!mode.is_held[i]) {
      if (by.rate[i] != 0.0) add(modal, mode.outputs + size_t(m + i) * st, by.rate[i]);
      if (by.resistive[i] != 0.0) put(i, 0.0, by.resistive[i]);
      if (by.smooth[i] != 0.0) put(m + i, by.smooth[i], 0.0);
    } else if (direct != 0.0) {
      for (int k : acting) put(k, direct * mode.feed[i * ni + k], direct * mode.feed_rate[i * ni + k]);
    }
  }
  for (int i : acting) {
    if (i < m) put(i, dot(mode.beta + size_t(i) * st, modal.data(), st), 0.0);
  }
  for (int k = 0; k < st; k++) state[k] += modal[k];
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
    const double a = signals_.start[p], length = signals_.end[p] - a, scaled = by * at.change.factor;
    const double x = degrees_[p] == 0 ? 0.0 : 2.0 * (time - at.shift - a) / length - 1.0;
    const double* k = signals_.coef.data() + DEGREE * p;
    double u = 0.0, slope = 0.0, power = scaled;
    for (int n = int(degrees_[p]); n >= 0; n--) {
      slope = slope * x + u;
      u = u * x + k[n];
    }
    for (int n = 0; n <= degrees_[p]; n++, power *= x) to.coef[DEGREE * p + n] += power;
    to.changes[3 * c] += by * u;
    to.changes[3 * c + 1] += by;
    if (slope == 0.0) return;
    const double moved = scaled * 2.0 / length * slope, part = 0.5 * (x + 1.0);
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
      const double sum = total(load(by));
      to.coef[DEGREE * at.piece] += sum * at.change.factor;
      to.changes[3 * c] += sum * signals_.coef[DEGREE * at.piece];
      to.changes[3 * c + 1] += sum;
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
    to.changes[3 * c + 2] -= by;
  }
};

}  // namespace tarsus::modal
