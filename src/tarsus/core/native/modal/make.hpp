// The step tables of a contact mode: exact flow over one step with inputs that are polynomials through nodal values.
#pragma once
#include "base/matrix2.hpp"
#include "modal/tables.hpp"

namespace tarsus::modal {

constexpr double REACH = 5.0;  // largest rate h over which the Taylor polynomial of the flow keeps 13 digits

// Largest singular value.
inline double norm_of(const Matrix2& x) {
  const auto& a = x.a;
  const double sum = a[0][0] * a[0][0] + a[0][1] * a[0][1] + a[1][0] * a[1][0] + a[1][1] * a[1][1];
  const double det = a[0][0] * a[1][1] - a[0][1] * a[1][0];
  return std::sqrt(0.5 * (sum + std::sqrt(std::max(sum * sum - 4.0 * det * det, 0.0))));
}

inline Matrix2 block_of(const ContactMode& mode, int b) {
  const int ns = mode.sizes.stride;
  return {{{mode.blocks[b], mode.blocks[ns + b]}, {mode.blocks[2 * ns + b], mode.blocks[3 * ns + b]}}};
}

// Terms of exp(rate h) to 1e-17, 0 where the step is too long to land in by a Taylor polynomial.
inline int taylor_terms(double rate, double length) {
  const double x = rate * length;
  if (x > REACH) return 0;
  int count = N + 2;
  double size = 1.0;
  for (int c = 1; c <= count; c++) size *= x / c;
  while (size > 1e-17 && count < TERMS) {
    count++;
    size *= x / count;
  }
  return count;
}

// Largest |row m| over matrices m, of an output's row (x, y) in one block.
inline double largest_row(double x, double y, const Matrix2* matrices, int count) {
  double out = 0.0;
  for (int j = 0; j < count; j++) {
    const auto& m = matrices[j].a;
    out = std::max(out, std::hypot(x * m[0][0] + y * m[1][0], x * m[0][1] + y * m[1][1]));
  }
  return out;
}

// Bounds of outputs at all later times under constant inputs, from y' = T y + inputs now: c y(t) = c y - c T^-1 y' +
// c T^-1 exp(T t) y'. level is c T^-1, and amplitude_bound the largest norm of c T^-1 exp(T t) in each block, infinite for one without
// a place of rest.
inline void fill_levels(ContactMode& mode) {
  const int ns = mode.sizes.stride;
  constexpr int TIMES = 200;
  for (int b = 0; b < mode.blocks_used; b++) {
    const Matrix2 block = block_of(mode, b);
    const auto& t = block.a;
    const double det = t[0][0] * t[1][1] - t[0][1] * t[1][0];
    const double size = std::max({std::fabs(t[0][0]), std::fabs(t[0][1]), std::fabs(t[1][0]), std::fabs(t[1][1])});
    const bool rests = std::fabs(det) > 1e-9 * size * size;
    const Matrix2 inverse = {{{t[1][1] / det, -t[0][1] / det}, {-t[1][0] / det, t[0][0] / det}}};
    Matrix2 flows[TIMES + 1];
    for (int n = 0; n <= TIMES; n++) {
      flows[n] = exponential_of(block, n == 0 ? 0.0 : std::pow(10.0, -3.0 + 6.0 * (n - 1) / (TIMES - 1.0)) / size);
    }
    for (int o = 0; o < mode.sizes.constraints(); o++) {
      double& amplitude_bound = mode.amplitude_bound[o * ns + b];
      amplitude_bound = INF;
      if (!rests) continue;
      const double x = mode.outputs[o * 2 * ns + b], y = mode.outputs[o * 2 * ns + ns + b];
      const double first = x * inverse.a[0][0] + y * inverse.a[1][0], second = x * inverse.a[0][1] + y * inverse.a[1][1];
      mode.level[o * 2 * ns + b] = first;
      mode.level[o * 2 * ns + ns + b] = second;
      amplitude_bound = 1.1 * largest_row(first, second, flows, TIMES + 1);
    }
  }
}

// The data of a contact mode that are the same for all its steps: rate, terms, and the tables for events inside a step.
inline void finish_mode(ContactMode& mode, const std::vector<double>& lengths) {
  const Sizes& sizes = mode.sizes;
  const int ns = sizes.stride, ni = sizes.inputs();
  if (mode.free.empty()) fill_levels(mode);  // only a structure that stands on all its feet may stay so for long
  mode.rate = 0.0;
  for (int b = 0; b < mode.blocks_used; b++) mode.rate = std::max(mode.rate, norm_of(block_of(mode, b)));
  mode.terms.clear();
  for (double h : lengths) mode.terms.push_back(taylor_terms(mode.rate, h));
  mode.landing_class = 0;
  while (mode.landing_class + 1 < int(lengths.size()) && mode.terms[mode.landing_class] == 0) mode.landing_class++;
  if (!(mode.rate > 0.0)) mode.rate = 1.0;
  for (int b = 0; b < mode.blocks_used; b++) {
    Matrix2 scaled = block_of(mode, b), power = {{{1.0, 0.0}, {0.0, 1.0}}};
    for (auto& row : scaled.a) {
      for (double& x : row) x /= mode.rate;
    }
    for (int c = 0; c < TERMS; c++) {
      for (int e = 0; e < 4; e++) mode.powers[(c * 4 + e) * ns + b] = power.a[e / 2][e % 2];
      for (int o = 0; o < sizes.constraints(); o++) {
        const double x = mode.outputs[o * 2 * ns + b], y = mode.outputs[o * 2 * ns + ns + b];
        const double first = x * power.a[0][0] + y * power.a[1][0], second = x * power.a[0][1] + y * power.a[1][1];
        mode.ladder[((o * ns + b) * 2) * TERMS + c] = first;
        mode.ladder[((o * ns + b) * 2 + 1) * TERMS + c] = second;
        for (int i = 0; i < ni; i++) {
          mode.markov[(o * ni + i) * MARKOV + BEFORE + c] +=
              first * mode.inputs[i * 2 * ns + b] + second * mode.inputs[i * 2 * ns + ns + b];
        }
        for (int s = 0; s < sizes.sources(); s++) {
          const double* in = mode.bias_inputs + s * 2 * ns;
          mode.bias_markov[(s * sizes.constraints() + o) * MARKOV + BEFORE + c] += first * in[b] + second * in[ns + b];
        }
      }
      power = times(power, scaled);
    }
  }
}

// int_0^L exp(T (L - s)) l_a(s / L) ds for L = tau_j h, all blocks b and nodes a: [j][b][c][d][a].
struct Duhamel {
  int nb;
  std::vector<double> data;

  explicit Duhamel(int blocks) : nb(blocks), data(size_t(N) * blocks * 4 * N, 0.0) {}
  double* at(int j, int b, int c, int d) { return data.data() + (((j * nb + b) * 2 + c) * 2 + d) * N; }
};

// By Taylor's series of exp(T (L - s)), for a step that resolves every mode.
inline Duhamel by_series(const ContactMode& mode, const Nodes& nodes, double h) {
  Duhamel phi(mode.blocks_used);
  for (int b = 0; b < phi.nb; b++) {
    for (int j = 1; j < N; j++) {
      const double length = nodes.tau[j] * h;
      Matrix2 step = block_of(mode, b), power = {{{length, 0.0}, {0.0, length}}};
      for (auto& row : step.a) {
        for (double& x : row) x *= length;
      }
      Row sum[4] = {Row(0.0), Row(0.0), Row(0.0), Row(0.0)};
      for (int n = 0; n < SERIES; n++) {
        for (int e = 0; e < 4; e++) sum[e] += load(nodes.series[n]) * power.a[e / 2][e % 2];
        power = times(power, step);
      }
      for (int e = 0; e < 4; e++) store(phi.at(j, b, e / 2, e % 2), sum[e]);
    }
  }
  return phi;
}

// From a step to one twice as long: a polynomial of degree 7 on an interval is one on each of its halves.
inline Duhamel doubled(Duhamel& half, const ContactMode& mode, const Nodes& nodes, double half_length) {
  Duhamel out(half.nb);
  for (int j = 1; j < N; j++) {
    for (int b = 0; b < half.nb; b++) {
      const Matrix2 flow = exponential_of(block_of(mode, b), nodes.tau[j] * half_length);
      Row left[2][2], right[2][2];
      for (int e = 0; e < 4; e++) {
        const Row from = load(half.at(j, b, e / 2, e % 2));
        left[e / 2][e % 2] = combine(&nodes.left[0][0], from);
        right[e / 2][e % 2] = combine(&nodes.right[0][0], from);
      }
      for (int e = 0; e < 4; e++) {
        const Row first = left[0][e % 2] * flow.a[e / 2][0], second = left[1][e % 2] * flow.a[e / 2][1];
        store(out.at(j, b, e / 2, e % 2), right[e / 2][e % 2] + (first + second));
      }
    }
  }
  return out;
}

// Bound of an output's deviation from the chord of two nodes, per |y'| of a block. With z = y', which flows by
// exp(T t) under constant inputs, that is at most sup |c T exp(T t)| d^2 / 8 |z| over a spacing d, and at most
// 2 sup |c T^-1 exp(T t)| |z|.
inline void fill_envelope(StepClass& step, const ContactMode& mode, const Nodes& nodes, double spacing) {
  const int ns = mode.sizes.stride;
  const double width = spacing * step.length;
  for (int b = 0; b < mode.blocks_used; b++) {
    const Matrix2 block = block_of(mode, b);
    const auto& t = block.a;
    const double det = t[0][0] * t[1][1] - t[0][1] * t[1][0];
    const double size = std::max({std::fabs(t[0][0]), std::fabs(t[0][1]), std::fabs(t[1][0]), std::fabs(t[1][1])});
    const bool regular = std::fabs(det) > 1e-9 * size * size;
    const Matrix2 inverse = {{{t[1][1] / det, -t[0][1] / det}, {-t[1][0] / det, t[0][0] / det}}};
    Matrix2 curved[N], level[N];
    for (int j = 0; j < N; j++) {
      const Matrix2 flow = exponential_of(block, nodes.tau[j] * step.length);
      curved[j] = times(block, flow);
      level[j] = times(inverse, flow);
    }
    for (int o = 0; o < mode.sizes.constraints(); o++) {
      const double x = mode.outputs[o * 2 * ns + b], y = mode.outputs[o * 2 * ns + ns + b];
      double bound = 1.1 * largest_row(x, y, curved, N) * width * width / 8.0;
      if (regular) bound = std::min(bound, 2.2 * largest_row(x, y, level, N));
      step.envelope[o * ns + b] = bound;
    }
  }
}

// Effect of inputs on the state over [0, tau_j h] and at the end of the step, and with it on the outputs.
inline void fill_inputs(StepClass& step, const ContactMode& mode, Duhamel& phi, const Nodes& nodes) {
  const Sizes& sizes = mode.sizes;
  const int ns = sizes.stride, ni = sizes.inputs(), nb = mode.blocks_used;
  std::vector<Row> partial(4 * nb), response(2 * nb);  // rows of nodal values
  for (int j = 1; j < N; j++) {
    for (int b = 0; b < nb; b++) {
      for (int e = 0; e < 4; e++) partial[4 * b + e] = combine(&nodes.partial[j][0][0], load(phi.at(j, b, e / 2, e % 2)));
    }
    for (int i = 0; i < sizes.last(); i++) {
      const double* in = mode.inputs + i * 2 * ns;
      for (int b = 0; b < nb; b++) {
        for (int c = 0; c < 2; c++) response[2 * b + c] = partial[4 * b + 2 * c] * in[b] + partial[4 * b + 2 * c + 1] * in[ns + b];
      }
      for (int o = 0; o < sizes.outputs; o++) {
        const double* out = mode.outputs + o * 2 * ns;
        Row sum = Row(0.0);
        for (int b = 0; b < nb; b++) sum += response[2 * b] * out[b] + response[2 * b + 1] * out[ns + b];
        for (int l = 0; l < N; l++) step.node_input[((o * ni + i) * N + l) * N + j] = sum[l];
      }
      if (j < N - 1) continue;
      for (int b = 0; b < nb; b++) {
        for (int c = 0; c < 2; c++) {
          const Row& value = response[2 * b + c];
          for (int l = 0; l < N; l++) step.state_input[(i * N + l) * 2 * ns + c * ns + b] = value[l];
          step.state_constant[i * 2 * ns + c * ns + b] = total(value);
        }
      }
    }
  }
}

// Effect of a unit of every source over [0, tau_j h]: the state at the end, and the outputs.
inline void fill_bias(StepClass& step, const ContactMode& mode, Duhamel& phi) {
  const Sizes& sizes = mode.sizes;
  const int ns = sizes.stride, nb = mode.blocks_used;
  std::vector<double> response(2 * nb);
  for (int s = 0; s < sizes.sources(); s++) {
    const double* in = mode.bias_inputs + s * 2 * ns;
    for (int j = 0; j < N; j++) {
      for (int b = 0; b < nb; b++) {
        for (int c = 0; c < 2; c++) {
          const double first = total(load(phi.at(j, b, c, 0))), second = total(load(phi.at(j, b, c, 1)));
          response[c * nb + b] = first * in[b] + second * in[ns + b];
          if (j == N - 1) step.state_bias[s * 2 * ns + c * ns + b] = response[c * nb + b];
        }
      }
      for (int o = 0; o < sizes.outputs; o++) {
        const double* out = mode.outputs + o * 2 * ns;
        double sum = mode.bias_feed[s * 2 * sizes.feet + o];
        for (int b = 0; b < nb; b++) sum += out[b] * response[b] + out[ns + b] * response[nb + b];
        step.node_bias[(s * sizes.outputs + o) * N + j] = sum;
      }
    }
  }
}

// Direct parts of the outputs, what constant inputs give, and how far smooth inputs reach.
inline void fill_direct(StepClass& step, const ContactMode& mode, const Nodes& nodes) {
  const Sizes& sizes = mode.sizes;
  const int ni = sizes.inputs();
  for (int o = 0; o < sizes.outputs; o++) {
    for (int i = 0; i < ni; i++) {
      double* to = step.node_input + (o * ni + i) * N * N;
      for (int l = 0; l < N; l++) {
        for (int j = 0; j < N; j++) {
          to[l * N + j] += mode.feed_rate[o * ni + i] * nodes.derivative[j][l] / step.length;
          if (l == j) to[l * N + j] += mode.feed[o * ni + i];
          step.node_constant[(o * ni + i) * N + j] += to[l * N + j];
        }
      }
    }
  }
  for (int i = 0; i < 2 * sizes.feet; i++) step.reach[i] = highest(magnitude(step.from_constant(i % sizes.feet, i)));
  for (int i : mode.sliding) {  // along the ground, at the rate that it comes to at most
    step.reach[sizes.feet + i] = step.length * highest(magnitude(step.from_constant(sizes.feet + i, sizes.feet + i)));
  }
}

inline std::unique_ptr<StepClass> make_step_tables(const ContactMode& mode, const std::vector<double>& lengths, int k,
                                                   const Nodes& nodes) {
  auto step = std::make_unique<StepClass>(mode.sizes, k, lengths[k], mode.terms[k]);
  const int ns = mode.sizes.stride;
  int halved = 0;  // times, to a step that resolves every mode, be it shorter than any that a run may take
  while (mode.rate * std::ldexp(lengths[k], -halved) > 1.0) halved++;
  Duhamel phi = by_series(mode, nodes, std::ldexp(lengths[k], -halved));
  for (; halved > 0; halved--) phi = doubled(phi, mode, nodes, std::ldexp(lengths[k], -halved));
  for (int b = 0; b < mode.blocks_used; b++) {
    for (int j = 0; j < N; j++) {
      const Matrix2 flow = exponential_of(block_of(mode, b), nodes.tau[j] * step->length);
      for (int e = 0; j == N - 1 && e < 4; e++) step->exponential[e * ns + b] = flow.a[e / 2][e % 2];
      for (int o = 0; o < mode.sizes.outputs; o++) {
        const double x = mode.outputs[o * 2 * ns + b], y = mode.outputs[o * 2 * ns + ns + b];
        for (int d = 0; d < 2; d++) {
          step->node_state[((o * ns + b) * 2 + d) * N + j] = x * flow.a[0][d] + y * flow.a[1][d];
        }
      }
    }
  }
  fill_inputs(*step, mode, phi, nodes);
  fill_bias(*step, mode, phi);
  fill_direct(*step, mode, nodes);
  fill_envelope(*step, mode, nodes, nodes.spacing);
  const double x = mode.rate * step->length;
  for (int c = 0; c < TERMS && x <= 1e7; c++) step->growth[c] = c == 0 ? 1.0 : step->growth[c - 1] * x / c;
  for (int c = 0; c < N; c++) step->share[c] = c == 0 ? 1.0 / mode.rate : step->share[c - 1] * c / x;
  return step;
}

}  // namespace tarsus::modal
