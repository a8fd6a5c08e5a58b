// Derivatives of contact modes and of their steps by a number of the structure.
//
// In the modal coordinates of a mode itself, which stay, its matrix T has a full matrix D of derivatives (tarsus.core.modes), and
// each pair of blocks of D makes a pair of exp and of what inputs do, by the same series and doublings as the tables:
//   exp(2A)' = exp(A)' exp(A) + exp(A) exp(A)'.
// No mode is derived by itself, so that modes may lie as close as they will.
#pragma once
#include "modal/make.hpp"
#include "record/replay.hpp"

namespace tarsus::modal {

// ``tables``: derivatives of those of a step, but for the flow (state, state) by rows, which is full.
struct DerivedStep {
  StepClass tables;
  std::vector<double> flow;
};

// ``rows``: derivatives of the arrays of a contact mode; coupling (state, state) by rows: of its matrix T.
struct DerivedMode {
  std::unique_ptr<ContactMode> rows;
  std::vector<double> coupling;
  std::vector<std::unique_ptr<DerivedStep>> steps;

  // Its 2 x 2 part of how block c drives block b.
  Matrix2 pair(int b, int c) const {
    const int ns = rows->sizes.stride, size = 2 * ns;
    const auto at = [&](int r, int d) { return coupling[size_t(r * ns + b) * size + d * ns + c]; };
    return {{{at(0, 0), at(0, 1)}, {at(1, 0), at(1, 1)}}};
  }
};

// A step from one that resolves every mode on, by doubling: of each length Duhamel's integrals and the flow to every node.
struct Levels {
  std::vector<double> lengths;
  std::vector<Duhamel> phi;
  std::vector<std::vector<Matrix2>> flows;  // (N, blocks)

  Levels(const ContactMode& mode, double length, const Nodes& nodes) {
    int halved = 0;
    while (mode.rate * std::ldexp(length, -halved) > 1.0) halved++;
    for (; halved >= 0; halved--) {
      lengths.push_back(std::ldexp(length, -halved));
      phi.push_back(phi.empty() ? by_series(mode, nodes, lengths[0])
                                : doubled(phi.back(), mode, nodes, lengths[lengths.size() - 2]));
      flows.emplace_back();
      for (int j = 0; j < N; j++) {
        for (int b = 0; b < mode.blocks_used; b++) flows.back().push_back(exponential_of(block_of(mode, b), nodes.tau[j] * lengths.back()));
      }
    }
  }
};

inline Matrix2 plus(const Matrix2& x, const Matrix2& y) {
  return {{{x.a[0][0] + y.a[0][0], x.a[0][1] + y.a[0][1]}, {x.a[1][0] + y.a[1][0], x.a[1][1] + y.a[1][1]}}};
}
inline Matrix2 scaled(const Matrix2& x, double by) {
  return {{{x.a[0][0] * by, x.a[0][1] * by}, {x.a[1][0] * by, x.a[1][1] * by}}};
}

// What block c makes of block b up to every node, per unit of the number: flow, and Duhamel's integrals.
struct PairTables {
  Matrix2 flow[N] = {};
  Row phi[N][4];

  PairTables(const ContactMode& mode, const Matrix2& coupling, int b, int c, const Levels& levels, const Nodes& nodes) {
    for (int j = 0; j < N; j++) begin(mode, coupling, b, c, j, nodes.tau[j] * levels.lengths[0], nodes);
    for (size_t level = 0; level + 1 < levels.lengths.size(); level++) {
      for (int j = 1; j < N; j++) {
        twice(j, levels.flows[level][j * mode.blocks_used + b], levels.flows[level][j * mode.blocks_used + c],
              const_cast<Duhamel&>(levels.phi[level]), c, nodes);
      }
    }
  }

 private:
  void begin(const ContactMode& mode, const Matrix2& coupling, int b, int c, int j, double length, const Nodes& nodes) {
    const Matrix2 left = scaled(block_of(mode, b), length), right = scaled(block_of(mode, c), length), by = scaled(coupling, length);
    Matrix2 power = {{{1.0, 0.0}, {0.0, 1.0}}}, moved = {};
    std::fill_n(phi[j], 4, Row(0.0));
    double factorial = 1.0;
    for (int n = 0; n < SERIES; n++) {
      for (int e = 0; e < 4; e++) phi[j][e] += load(nodes.series[n]) * (length * moved.a[e / 2][e % 2]);
      flow[j] = plus(flow[j], scaled(moved, 1.0 / factorial));
      moved = plus(times(moved, right), times(power, by));
      power = times(power, left);
      factorial *= n + 1;
    }
  }

  void twice(int j, const Matrix2& to, const Matrix2& from, Duhamel& before, int c, const Nodes& nodes) {
    Row first[4], moved[4], second[4];
    for (int e = 0; e < 4; e++) {
      first[e] = combine(&nodes.left[0][0], load(before.at(j, c, e / 2, e % 2)));
      moved[e] = combine(&nodes.left[0][0], phi[j][e]);
      second[e] = combine(&nodes.right[0][0], phi[j][e]);
    }
    for (int e = 0; e < 4; e++) {
      const int r = e / 2, d = e % 2;
      phi[j][e] = second[e] + ((first[d] * flow[j].a[r][0] + first[2 + d] * flow[j].a[r][1]) +
                               (moved[d] * to.a[r][0] + moved[2 + d] * to.a[r][1]));
    }
    flow[j] = plus(times(flow[j], from), times(to, flow[j]));
  }
};

// What inputs and sources do to the state up to every node, each nodal value: (N, inputs and sources, state).
class Response {
 public:
  explicit Response(const Sizes& s) : sizes_(s), count_(s.last() + s.sources()), rows_(size_t(N) * count_ * s.state(), Row(0.0)) {}

  Row* at(int j, int input) { return rows_.data() + (size_t(j) * count_ + input) * sizes_.state(); }
  // A source comes after all inputs.
  int source(int s) const { return sizes_.last() + s; }

  // Add what block b has through integrals from what comes into block c by the inputs of a mode's arrays.
  void add(const ContactMode& by, int b, int c, int j, const Row* phi, const Nodes& nodes) {
    const int ns = sizes_.stride;
    Row part[4];
    for (int e = 0; e < 4; e++) part[e] = combine(&nodes.partial[j][0][0], phi[e]);
    for (int i = 0; i < count_; i++) {
      const double* in = i < sizes_.last() ? by.inputs + i * 2 * ns : by.bias_inputs + (i - sizes_.last()) * 2 * ns;
      Row* to = at(j, i);
      for (int r = 0; r < 2; r++) to[r * ns + b] += part[2 * r] * in[c] + part[2 * r + 1] * in[ns + c];
    }
  }

 private:
  const Sizes& sizes_;
  int count_;
  std::vector<Row> rows_;
};

// Outputs at the nodes by what inputs and sources do, and the state at the end.
inline void fill_derived_inputs(DerivedStep& out, const ContactMode& mode, const ContactMode& by, Response& plain, Response& moved) {
  StepClass& step = out.tables;
  const Sizes& s = mode.sizes;
  const int ni = s.inputs(), state = s.state();
  for (int i = 0; i < s.last() + s.sources(); i++) {
    const bool source = i >= s.last();
    for (int j = 1; j < N; j++) {
      const Row *own = plain.at(j, i), *change = moved.at(j, i);
      for (int o = 0; o < s.outputs; o++) {
        Row sum = Row(0.0);
        for (int k = 0; k < state; k++) sum += own[k] * by.outputs[o * state + k] + change[k] * mode.outputs[o * state + k];
        if (source) step.node_bias[((i - s.last()) * s.outputs + o) * N + j] = total(sum);
        for (int l = 0; l < N && !source; l++) step.node_input[((o * ni + i) * N + l) * N + j] = sum[l];
      }
    }
    for (int k = 0; k < state; k++) {
      const Row& value = moved.at(N - 1, i)[k];
      if (source) step.state_bias[(i - s.last()) * state + k] = total(value);
      for (int l = 0; l < N && !source; l++) step.state_input[(i * N + l) * state + k] = value[l];
    }
  }
  for (int q = 0; q < s.sources(); q++) {
    for (int o = 0; o < s.outputs; o++) {
      for (int j = 0; j < N; j++) step.node_bias[(q * s.outputs + o) * N + j] += by.bias_feed[q * 2 * s.feet + o];
    }
  }
}

inline std::unique_ptr<DerivedStep> derive_step(const ContactMode& mode, const DerivedMode& by, const std::vector<double>& lengths, int k,
                                                const Nodes& nodes) {
  const Sizes& s = mode.sizes;
  const int ns = s.stride, nb = mode.blocks_used, state = s.state();
  auto out = std::unique_ptr<DerivedStep>(new DerivedStep{{s, k, lengths[k], mode.terms[k]}, std::vector<double>(size_t(state) * state, 0.0)});
  Levels levels(mode, lengths[k], nodes);
  Response plain(s), moved(s);
  // outputs from block c, by rows of outputs on block b and what flows from c to b
  const auto add_outputs = [&](const ContactMode& rows, int b, int c, int j, const Matrix2& flow) {
    for (int o = 0; o < s.outputs; o++) {
      const double x = rows.outputs[o * state + b], y = rows.outputs[o * state + ns + b];
      for (int d = 0; d < 2; d++) out->tables.node_state[((o * ns + c) * 2 + d) * N + j] += x * flow.a[0][d] + y * flow.a[1][d];
    }
  };
  for (int b = 0; b < nb; b++) {
    for (int j = 0; j < N; j++) {
      Row phi[4];
      for (int e = 0; e < 4; e++) phi[e] = load(levels.phi.back().at(j, b, e / 2, e % 2));
      plain.add(mode, b, b, j, phi, nodes);
      moved.add(*by.rows, b, b, j, phi, nodes);
      add_outputs(*by.rows, b, b, j, levels.flows.back()[j * nb + b]);
    }
    for (int c = 0; c < nb; c++) {
      const Matrix2 coupling = by.pair(b, c);
      if (coupling.a[0][0] == 0.0 && coupling.a[0][1] == 0.0 && coupling.a[1][0] == 0.0 && coupling.a[1][1] == 0.0) continue;
      const PairTables pair(mode, coupling, b, c, levels, nodes);
      for (int j = 0; j < N; j++) {
        moved.add(mode, b, c, j, pair.phi[j], nodes);
        add_outputs(mode, b, c, j, pair.flow[j]);
      }
      for (int e = 0; e < 4; e++) out->flow[size_t(e / 2 * ns + b) * state + e % 2 * ns + c] = pair.flow[N - 1].a[e / 2][e % 2];
    }
  }
  fill_derived_inputs(*out, mode, *by.rows, plain, moved);
  fill_direct(out->tables, *by.rows, nodes);
  return out;
}

// The derivatives of a book by one number, made when a march first needs them, outside of any lock; safe between threads.
class DerivedBook {
 public:
  Book& book;

  explicit DerivedBook(Book& b) : book(b) {}
  virtual ~DerivedBook() = default;
  DerivedBook(const DerivedBook&) = delete;

  DerivedMode& mode(const ContactMode& of) {
    const size_t q = of.number;
    const auto place = [&]() -> std::unique_ptr<DerivedMode>& {
      if (modes_.size() <= q) modes_.resize(q + 1);
      return modes_[q];
    };
    return first_made<DerivedMode>(place, [&] {
      std::unique_ptr<DerivedMode> made = make(of);
      made->steps.resize(book.classes());
      return made;
    });
  }
  const DerivedStep& step(const ContactMode& of, int k) {
    DerivedMode& by = mode(of);
    const auto place = [&]() -> std::unique_ptr<DerivedStep>& { return by.steps[k]; };
    return first_made<DerivedStep>(place, [&] { return new_step(of, by, k); });
  }

 protected:
  virtual std::unique_ptr<DerivedMode> make(const ContactMode& of) = 0;
  virtual std::unique_ptr<DerivedStep> new_step(const ContactMode& of, const DerivedMode& by, int k) = 0;

 private:
  std::mutex mutex_;
  std::vector<std::unique_ptr<DerivedMode>> modes_;  // by number

  // What is kept at a place; where two threads make the same, the first stays.
  template <class Made, class Place, class Make>
  Made& first_made(const Place& place, const Make& make) {
    {
      std::lock_guard<std::mutex> lock(mutex_);
      if (place() != nullptr) return *place();
    }
    std::unique_ptr<Made> made = make();
    std::lock_guard<std::mutex> lock(mutex_);
    if (place() == nullptr) place() = std::move(made);
    return *place();
  }
};

}  // namespace tarsus::modal
