// Exact motion of one leg in one direction over a step, as matrices between nodes, made when first asked for.
//
// The block y' = A y + b Q + d P of legged/body.hpp is linear: for Q and P that are polynomials of degree 7
// within a step, given by their values at the nodes, u and w at the nodes are linear in them and in u(0),
// w(0). The integrals of exp(A s) against the polynomials are taken by Gauss quadrature on panels that halve
// towards s = 0, so that a fast decay is resolved.
#pragma once
#include <atomic>
#include <memory>

#include "base/matrix2.hpp"
#include "base/nodes.hpp"

namespace tarsus::legged {

constexpr double OSCILLATION =
    5.0;  // radians of a leg's own oscillation in a step at most, so that the nodes see its turns

// The exact motion of one kind of leg over a step of one length.
struct alignas(64) LegStep {
  double state[4][N];      // at the nodes: u of u0, u of w0, w of u0, w of w0
  double force[2][N][N];   // u and w at the nodes (last index) of a force at one node
  double film[2][N][N];    // the same of a film's momentum
  double force_end[2][N];  // the same at the end of the step alone
  double film_end[2][N];
  double follow[2][N][N];  // u and w at the nodes (last index) of a hip displaced at one node
  double reach_force, reach_film;  // largest |u| under a constant one
  double missed_film;              // and under a momentum of the shape that the nodes begin to miss, see ``missed_shape``
};

// What a polynomial of degree 7 through the nodes misses begins with the Legendre polynomials above it, and what these move is
// less than under one of degree 6 of the same size: oscillating faster, it integrates to less. (The integral of
// that of degree 7 is zero at the very nodes, so it shows nothing there.)
inline Row missed_shape(const Nodes& nodes) {
  const Row x = nodes.times() * 2.0 - 1.0;
  Row before = Row(1.0), value = x;
  for (int n = 2; n < N - 1; n++) {
    const Row next = (x * value * (2.0 * n - 1.0) - before * (n - 1.0)) * (1.0 / n);
    before = value;
    value = next;
  }
  return value;
}

// Points s of [0, 1] and what weighs exp(A s): Lagrange values at node - s.
struct Panels {
  static constexpr int GAUSS = 14, PANEL_HALVINGS = 16;
  std::vector<double> points;
  std::vector<double> kernel;  // (points, N in, N out)

  explicit Panels(const Nodes& nodes) {
    std::vector<double> edges(nodes.tau, nodes.tau + N);
    for (int n = 1; n <= PANEL_HALVINGS; n++) edges.push_back(std::ldexp(1.0, -n));
    std::sort(edges.begin(), edges.end());
    double x[GAUSS], weight[GAUSS];
    gauss(x, weight);
    for (size_t e = 1; e < edges.size(); e++) {
      const double width = edges[e] - edges[e - 1];
      if (width <= 0.0) continue;
      for (int g = 0; g < GAUSS; g++)
        add(nodes, edges[e - 1] + 0.5 * width * (x[g] + 1.0), 0.5 * width * weight[g]);
    }
  }

 private:
  void add(const Nodes& nodes, double s, double weight) {
    points.push_back(s);
    for (int j = 0; j < N; j++) {
      for (int n = 0; n < N; n++) {
        double value = nodes.tau[n] > s ? weight : 0.0;
        for (int k = 0; k < N; k++) {
          if (k != j) value *= (nodes.tau[n] - s - nodes.tau[k]) / (nodes.tau[j] - nodes.tau[k]);
        }
        kernel.push_back(value);
      }
    }
  }
  // Gauss-Legendre points and weights on [-1, 1]: Newton's method on the Legendre polynomial.
  static void gauss(double* x, double* weight) {
    for (int g = 0; g < GAUSS; g++) {
      double at = std::cos(3.141592653589793 * (g + 0.75) / (GAUSS + 0.5)), slope = 1.0;
      for (int n = 0; n < 20; n++) {
        double before = 1.0, value = at;
        for (int d = 2; d <= GAUSS; d++) {
          const double next = ((2 * d - 1) * at * value - (d - 1) * before) / d;
          before = value;
          value = next;
        }
        slope = GAUSS * (at * value - before) / (at * at - 1.0);
        at -= value / slope;
      }
      x[g] = at;
      weight[g] = 2.0 / ((1.0 - at * at) * slope * slope);
    }
  }
};

// Steps of every length for every kind of leg, given by mass [kg], stiffness [N/m] and damping [N s/m].
// Threads may share them: a step is made outside of any lock, and the first one made is kept.
class LegTables {
 public:
  std::vector<double> lengths;  // [s], falling
  std::vector<double> rate;     // [1/s] of the fastest motion of every kind
  std::vector<int> longest;     // first class whose nodes see the kind's own oscillation

  LegTables(const Nodes& n, std::vector<double> m, std::vector<double> k, std::vector<double> c,
            std::vector<double> steps)
      : lengths(std::move(steps)),
        nodes(n),
        panels(n),
        mass(std::move(m)),
        stiffness(std::move(k)),
        damping(std::move(c)),
        made(new std::atomic<LegStep*>[lengths.size() * mass.size()]) {
    for (size_t q = 0; q < lengths.size() * mass.size(); q++) made[q] = nullptr;
    for (size_t i = 0; i < mass.size(); i++) {
      const double natural = std::sqrt(stiffness[i] / mass[i]);
      const double turning = damping[i] < 2.0 * mass[i] * natural ? natural : 0.0;
      int coarsest = 0;
      for (double length : lengths) coarsest += length * turning > OSCILLATION;
      rate.push_back(std::max(natural, damping[i] / mass[i]));
      longest.push_back(coarsest);
    }
  }
  ~LegTables() {
    for (size_t q = 0; q < lengths.size() * mass.size(); q++) delete made[q].load();
  }
  LegTables(const LegTables&) = delete;
  LegTables& operator=(const LegTables&) = delete;

  int classes() const { return int(lengths.size()); }

  const LegStep& of(int k, int kind) const {
    std::atomic<LegStep*>& place = made[size_t(k) * mass.size() + kind];
    const LegStep* found = place.load(std::memory_order_acquire);
    if (__builtin_expect(found != nullptr, 1)) return *found;
    LegStep* mine = new LegStep(make(k, kind));
    LegStep* none = nullptr;
    if (place.compare_exchange_strong(none, mine)) return *mine;
    delete mine;
    return *none;
  }

 private:
  const Nodes nodes;
  const Panels panels;
  const std::vector<double> mass, stiffness, damping;
  std::unique_ptr<std::atomic<LegStep*>[]> made;

  TARSUS_APART LegStep make(int k, int kind) const {
    const double m = 1.0 / mass[kind], c = damping[kind], h = lengths[k];
    const Matrix2 block = {{{0.0, 1.0}, {-stiffness[kind] * m, -c * m}}};
    LegStep out;
    for (int n = 0; n < N; n++) {
      const Matrix2 flow = exponential_of(block, h * nodes.tau[n]);
      for (int e = 0; e < 4; e++) out.state[e][n] = flow.a[e / 2][e % 2];
    }
    Row force[2][N], film[2][N];
    for (int e = 0; e < 2 * N; e++) force[e / N][e % N] = film[e / N][e % N] = Row(0.0);
    for (size_t g = 0; g < panels.points.size(); g++) {
      const Matrix2 flow = exponential_of(block, h * panels.points[g]);
      const double* kernel = panels.kernel.data() + g * N * N;
      for (int v = 0; v < 2; v++) {
        const double by_force = h * m * flow.a[v][1], by_film = h * m * (flow.a[v][0] - c * m * flow.a[v][1]);
        for (int j = 0; j < N; j++) {
          force[v][j] += load(kernel + j * N) * by_force;
          film[v][j] += load(kernel + j * N) * by_film;
        }
      }
    }
    Row all_force = Row(0.0), all_film = Row(0.0);
    for (int j = 0; j < N; j++) {
      for (int v = 0; v < 2; v++) {
        store(out.force[v][j], force[v][j]);
        store(out.film[v][j], film[v][j]);
        out.force_end[v][j] = force[v][j][N - 1];
        out.film_end[v][j] = film[v][j][N - 1];
      }
      all_force += force[0][j];
      all_film += film[0][j];
    }
    for (int v = 0; v < 2; v++) {
      for (int j = 0; j < N; j++) {
        Row sum = force[v][j] * stiffness[kind];
        for (int l = 0; l < N; l++) sum += force[v][l] * (c / h * nodes.derivative[l][j]);
        store(out.follow[v][j], sum);
      }
    }
    out.reach_force = highest(magnitude(all_force));
    out.reach_film = highest(magnitude(all_film));
    out.missed_film = highest(magnitude(combine(out.film[0][0], missed_shape(nodes))));
    return out;
  }
};

}  // namespace tarsus::legged
