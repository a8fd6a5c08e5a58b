// Exact motion of a whole walker of few legs over a step, in each of its contact states, as matrices made when first asked for.
//
// While no contact changes the walker is linear, y' = A y + B v, but for what the films, the smooth forces and friction do, and
// these are inputs v beside gravity and the drives: polynomials of degree 7 within a step. The state y is the body's place and
// velocity, then of every leg upward and along u and w (see legged/body.hpp). Of a length that resolves every motion the
// integrals of exp(A t) against the polynomials are a series, of longer ones they follow by doubling.
#pragma once
#include <atomic>
#include <memory>
#include <mutex>

#include "legged/body.hpp"

namespace tarsus::legged {

constexpr int MOST_WHOLE = 24;  // numbers of the state, in three machine rows
constexpr int CONTACTS = 3;     // states of a foot: in the air, stuck, sliding
constexpr int SLOTS = 2;        // inputs of a leg: film's momentum and smooth force in the air; friction along of a sliding one
constexpr int SEEN = 2;         // outputs of a leg, see WholeSystem

// Which number of the state, input or output is whose. Inputs: gravity, drives, then slots. Columns of a step: those of the state, of
// constant inputs, then of drives and slots at each node; a column's machine rows: outputs at the nodes, the state at the end,
// and what makes it a multiple of four.
struct WholeLayout {
  int coordinates, legs, drives, size, rows, first_slot, inputs, outputs, columns, width;

  explicit WholeLayout(const Body& body)
      : coordinates(body.coordinates()), legs(int(body.legs.size())), drives(body.drives),
        size(2 * coordinates + 2 * DIRECTIONS * legs), rows((size + N - 1) / N), first_slot(1 + drives),
        inputs(first_slot + SLOTS * legs), outputs(SEEN * legs + 2), columns(size + inputs + N * (inputs - 1)),
        width((outputs + rows + 3) / 4 * 4) {}
  int x(int b) const { return b; }
  int v(int b) const { return coordinates + b; }
  int u(int i, int d) const { return 2 * coordinates + 2 * (DIRECTIONS * i + d); }
  int w(int i, int d) const { return u(i, d) + 1; }
  int drive(int d) const { return 1 + d; }
  int slot(int i, int k) const { return first_slot + SLOTS * i + k; }
  int seen(int i, int k) const { return SEEN * i + k; }
  int height(int k) const { return SEEN * legs + k; }
  int constant(int input) const { return size + input; }
  int nodal(int input) const { return size + inputs + N * (input - 1); }
};

// The equations in one contact state. Outputs: of a foot in the air u and w upward; of a sliding one its pull and w along; of a
// stuck one its pull and the force along; last the body's height and its rate.
struct WholeSystem {
  WholeLayout at;
  std::vector<double> a, b, c, d;  // (size, size), (size, inputs), (outputs, size), (outputs, inputs)
  double rate = 0.0, sway = 0.0;   // [1/s] of the fastest motion at most, and of the body on the feet that are held

  WholeSystem(const Body& body, int state)
      : at(body), a(at.size * at.size, 0.0), b(at.size * at.inputs, 0.0), c(at.outputs * at.size, 0.0),
        d(at.outputs * at.inputs, 0.0) {
    std::vector<double> stiffness(at.coordinates, 0.0), damping(at.coordinates, 0.0), standing(at.coordinates, 0.0);
    double legs = 0.0;
    for (int n = 0; n < at.coordinates; n++) {
      A(at.x(n), at.v(n)) = 1.0;
      B(at.v(n), 0) = -body.weight[n] / body.mass[n];
      for (int e = 0; e < at.drives; e++) B(at.v(n), at.drive(e)) = body.load[e * at.coordinates + n] / body.mass[n];
      C(at.height(0), at.x(1)) = C(at.height(1), at.v(1)) = 1.0;
    }
    for (int i = 0; i < at.legs; i++, state /= CONTACTS) {
      const Leg& leg = body.legs[i];
      const int contact = state % CONTACTS;
      for (int d = 0; d < DIRECTIONS; d++) {
        const bool held = contact == 1 || (d == UP && contact == 2);
        add_leg(body, i, d, held);
        see(body, i, d, contact);
        legs = std::max(legs, std::max(std::sqrt(leg.stiffness[d] / leg.mass), leg.damping[d] / leg.mass));
        for (int n = 0; n < leg.hip[d].count; n++) {
          const int at_b = leg.hip[d].at[n];
          const double by = leg.hip[d].by[n] * leg.hip[d].by[n] / body.mass[at_b];
          stiffness[at_b] += by * leg.stiffness[d];
          damping[at_b] += by * leg.damping[d];
          if (held) standing[at_b] += by * leg.stiffness[d];
        }
      }
      if (contact == 2) B(at.w(i, ALONG), at.slot(i, 0)) = 1.0 / leg.mass;
      if (contact != 0) continue;
      B(at.u(i, UP), at.slot(i, 0)) = 1.0 / leg.mass;
      B(at.w(i, UP), at.slot(i, 0)) = -leg.damping[UP] / (leg.mass * leg.mass);
      B(at.w(i, UP), at.slot(i, 1)) = 1.0 / leg.mass;
      for (int n = 0; n < leg.hip[UP].count; n++) {
        const int of = leg.hip[UP].at[n];
        B(at.v(of), at.slot(i, 0)) = leg.hip[UP].by[n] * leg.damping[UP] / (leg.mass * body.mass[of]);
      }
    }
    for (int n = 0; n < at.coordinates; n++) {
      rate += std::sqrt(stiffness[n]) + damping[n];
      sway += std::sqrt(standing[n]);
    }
    rate += legs;
  }

  double& A(int to, int from) { return a[to * at.size + from]; }
  double& B(int to, int input) { return b[to * at.inputs + input]; }
  double& C(int output, int from) { return c[output * at.size + from]; }
  double& D(int output, int input) { return d[output * at.inputs + input]; }

 private:
  // Spring and damper between a foot and its hip, and what drives and weight do to the foot.
  void add_leg(const Body& body, int i, int d, bool held) {
    const Leg& leg = body.legs[i];
    const Hip& hip = leg.hip[d];
    const double k = leg.stiffness[d], damper = leg.damping[d], m = 1.0 / leg.mass;
    for (int n = 0; n < hip.count; n++) {
      const int to = at.v(hip.at[n]);
      const double by = hip.by[n] / body.mass[hip.at[n]];
      for (int l = 0; l < hip.count; l++) {
        A(to, at.x(hip.at[l])) -= by * hip.by[l] * k;
        A(to, at.v(hip.at[l])) -= by * hip.by[l] * damper;
      }
      A(to, at.u(i, d)) += by * k;
      if (!held) A(to, at.w(i, d)) += by * damper;
    }
    if (held) return;
    const int w = at.w(i, d);
    A(at.u(i, d), w) = 1.0;
    A(w, at.u(i, d)) = -k * m;
    A(w, w) = -damper * m;
    for (int n = 0; n < hip.count; n++) {
      A(w, at.x(hip.at[n])) += k * hip.by[n] * m;
      A(w, at.v(hip.at[n])) += damper * hip.by[n] * m;
    }
    if (d == UP) B(w, 0) = -leg.weight * m;
    for (int n = leg.first; n < leg.last; n++) B(w, at.drive(body.drive[n])) += body.gain[2 * n + d] * m;
  }

  void see(const Body& body, int i, int d, int contact) {
    const Leg& leg = body.legs[i];
    const Hip& hip = leg.hip[d];
    if (contact == 0) {
      if (d == UP) C(at.seen(i, 0), at.u(i, UP)) = C(at.seen(i, 1), at.w(i, UP)) = 1.0;
      return;
    }
    if (d == ALONG && contact == 2) {
      C(at.seen(i, 1), at.w(i, ALONG)) = 1.0;
      return;
    }
    const int out = at.seen(i, d == UP ? 0 : 1);
    for (int n = 0; n < hip.count; n++) {
      C(out, at.x(hip.at[n])) += leg.stiffness[d] * hip.by[n];
      C(out, at.v(hip.at[n])) += leg.damping[d] * hip.by[n];
    }
    C(out, at.u(i, d)) = -leg.stiffness[d];
    if (d == UP) D(out, 0) = -leg.weight;
    for (int n = leg.first; n < leg.last; n++) D(out, at.drive(body.drive[n])) += body.gain[2 * n + d];
  }
};

// A step of one length in one contact state: columns of ``width`` machine rows, see WholeLayout.
struct WholeStep {
  std::vector<Row> column;
  std::vector<Row> effect;    // (legs, slots of all, N): first output of a leg at the nodes, of a slot at one node
  std::vector<double> reach;  // (inputs): how far a constant one moves its foot [m] at most, a drive any foot
};

// What of a contact state is the same for all lengths.
struct WholeState {
  WholeSystem system;
  std::vector<Row> flow, input;  // A and B by columns, each of rows() machine rows

  WholeState(const Body& body, int state) : system(body, state) {
    const WholeLayout& at = system.at;
    flow = by_columns(system.a, at.size, at.rows);
    input = by_columns(system.b, at.inputs, at.rows);
  }

  static std::vector<Row> by_columns(const std::vector<double>& matrix, int columns, int rows) {
    std::vector<Row> out(columns * rows, Row(0.0));
    for (size_t e = 0; e < matrix.size(); e++) {
      const int to = int(e) / columns, from = int(e) % columns;
      out[from * rows + to / N].set(to % N, matrix[e]);
    }
    return out;
  }
};

// out += matrix x, a matrix by columns of ``rows`` machine rows.
TARSUS_INLINE void apply(const Row* matrix, int columns, int rows, const Row* x, Row* out) {
  const double* value = reinterpret_cast<const double*>(x);
  for (int c = 0; c < columns; c++) {
    for (int r = 0; r < rows; r++) out[r] += matrix[c * rows + r] * value[c];
  }
}

// The flow exp(A t) over t = tau_j h, and what inputs through the nodes of [0, tau_j h] add to it.
class WholeMaker {
 public:
  WholeMaker(const WholeState& of, const Nodes& n, double h)
      : state(of), at(of.system.at), nodes(n), size(at.size), rows(at.rows), length(h) {
    flow.assign(N * size * rows, Row(0.0));
    forced.assign(N * at.inputs * N * rows, Row(0.0));
    double series[TERMS][N];
    for (int k = 0; k < TERMS; k++) {
      for (int a = 0; a < N; a++) series[k][a] = moment(k, a);
    }
    for (int c = 0; c < size; c++) {
      std::vector<Row> term(rows, Row(0.0));
      term[c / N].set(c % N, 1.0);
      double factorial = 1.0;
      for (int k = 0; k < TERMS; k++, factorial /= k) {
        for (int j = 0; j < N; j++) add(flow_at(j) + c * rows, term, factorial * std::pow(nodes.tau[j] * h, k));
        term = next(term);
      }
    }
    for (int b = 0; b < at.inputs; b++) {
      std::vector<Row> term(state.input.begin() + b * rows, state.input.begin() + (b + 1) * rows);
      for (int k = 0; k < TERMS; k++) {
        for (int j = 1; j < N; j++) {
          const double power = std::pow(nodes.tau[j] * h, k + 1);
          for (int a = 0; a < N; a++) add(forced_at(j, b, a), term, power * series[k][a]);
        }
        term = next(term);
      }
    }
  }

  // From a step to one twice as long: a polynomial of degree 7 on an interval is one on each of its halves.
  void double_length() {
    double left[N][N], right[N][N];
    for (int i = 0; i < N; i++) {
      for (int a = 0; a < N; a++) {
        left[i][a] = lagrange(a, 0.5 * nodes.tau[i]);
        right[i][a] = lagrange(a, 0.5 + 0.5 * nodes.tau[i]);
      }
    }
    std::vector<Row> first(rows), second(rows), made(N * rows), squared(size * rows);
    for (int j = 1; j < N; j++) {
      for (int b = 0; b < at.inputs; b++) {
        for (int a = 0; a < N; a++) {
          for (int r = 0; r < rows; r++) {
            Row early = Row(0.0), late = Row(0.0);
            for (int i = 0; i < N; i++) {
              early += forced_at(j, b, i)[r] * left[i][a];
              late += forced_at(j, b, i)[r] * right[i][a];
            }
            first[r] = early;
            second[r] = late;
          }
          apply(flow_at(j), size, rows, first.data(), second.data());
          std::copy(second.begin(), second.end(), made.begin() + a * rows);
        }
        std::copy(made.begin(), made.end(), forced_at(j, b, 0));
      }
      std::fill(squared.begin(), squared.end(), Row(0.0));
      for (int c = 0; c < size; c++) apply(flow_at(j), size, rows, flow_at(j) + c * rows, squared.data() + c * rows);
      std::copy(squared.begin(), squared.end(), flow_at(j));
    }
    length *= 2.0;
  }

  WholeStep step() {
    WholeStep out;
    const int width = at.width;
    out.column.assign(at.columns * width, Row(0.0));
    for (int c = 0; c < size; c++) {
      for (int j = 0; j < N; j++) put(out, c, j, flow_at(j) + c * rows);
    }
    const Row zero[MOST_WHOLE / N] = {Row(0.0), Row(0.0), Row(0.0)};
    out.reach.assign(at.inputs, 0.0);
    for (int b = 0; b < at.inputs; b++) {
      for (int j = 0; j < N; j++) {
        Row all[MOST_WHOLE / N] = {zero[0], zero[1], zero[2]};
        for (int a = 0; a < N; a++) {
          Row part[MOST_WHOLE / N] = {zero[0], zero[1], zero[2]};
          for (int i = 0; i < N; i++) {
            const double share = lagrange(a, nodes.tau[j] * nodes.tau[i]);
            for (int r = 0; r < rows; r++) part[r] += forced_at(j, b, i)[r] * share;
          }
          for (int r = 0; r < rows; r++) all[r] += part[r];
          if (b > 0) {
            put(out, at.nodal(b) + a, j, part);
            feed(out, at.nodal(b) + a, j, b, a == j ? 1.0 : 0.0);
          }
        }
        put(out, at.constant(b), j, all);
        feed(out, at.constant(b), j, b, 1.0);
        out.reach[b] = std::max(out.reach[b], farthest(reinterpret_cast<const double*>(all), b));
      }
    }
    for (int i = 0; i < at.legs; i++) {
      for (int b = at.first_slot; b < at.inputs; b++) {
        for (int a = 0; a < N; a++) out.effect.push_back(out.column[(at.nodal(b) + a) * width + at.seen(i, 0)]);
      }
    }
    return out;
  }

 private:
  static constexpr int TERMS = 20;  // of Taylor's series over half a radian of the fastest motion
  const WholeState& state;
  const WholeLayout& at;
  const Nodes& nodes;
  const int size, rows;
  double length;
  std::vector<Row> flow;    // (node, size, rows)
  std::vector<Row> forced;  // (node, input, node of the polynomial on [0, tau_j h], rows)

  Row* flow_at(int j) { return flow.data() + j * size * rows; }
  Row* forced_at(int j, int b, int a) { return forced.data() + ((j * at.inputs + b) * N + a) * rows; }
  void add(Row* to, const std::vector<Row>& term, double by) const {
    for (int r = 0; r < rows; r++) to[r] += term[r] * by;
  }
  std::vector<Row> next(const std::vector<Row>& term) const {
    std::vector<Row> out(rows, Row(0.0));
    apply(state.flow.data(), size, rows, term.data(), out.data());
    return out;
  }
  // Value at s of the polynomial that is 1 at node a and 0 at the others.
  double lagrange(int a, double s) const {
    double value = 1.0;
    for (int k = 0; k < N; k++) {
      if (k != a) value *= (s - nodes.tau[k]) / (nodes.tau[a] - nodes.tau[k]);
    }
    return value;
  }
  // Integral over [0, 1] of (1 - s)^k / k! times that polynomial: c! / (k + c + 1)! of each power.
  double moment(int k, int a) const {
    long double sum = 0.0, power = 1.0;
    for (int n = 1; n <= k + 1; n++) power /= n;
    for (int c = 0; c < N; c++) {
      sum += power * nodes.monomial[c][a];
      power *= (c + 1.0L) / (k + c + 2.0L);
    }
    return double(sum);
  }
  // Enter the state at node j into a column: what is seen of it, and at the last node itself.
  void put(WholeStep& out, int column, int j, const Row* y) const {
    const double* value = reinterpret_cast<const double*>(y);
    Row* to = out.column.data() + column * at.width;
    for (int o = 0; o < at.outputs; o++) {
      double sum = 0.0;
      for (int n = 0; n < size; n++) sum += state.system.c[o * size + n] * value[n];
      reinterpret_cast<double*>(to + o)[j] += sum;
    }
    if (j == N - 1) std::copy(y, y + rows, to + at.outputs);
  }
  void feed(WholeStep& out, int column, int j, int b, double by) const {
    Row* to = out.column.data() + column * at.width;
    for (int o = 0; o < at.outputs; o++) reinterpret_cast<double*>(to + o)[j] += by * state.system.d[o * at.inputs + b];
  }
  double farthest(const double* y, int b) const {
    double out = 0.0;
    for (int i = 0; i < at.legs; i++) {
      const bool own = b >= at.slot(i, 0) && b < at.slot(i, SLOTS);
      if (b >= at.slot(0, 0) && !own) continue;
      out = std::max({out, std::fabs(y[at.u(i, UP)]), std::fabs(y[at.u(i, ALONG)])});
    }
    return out;
  }
};

// Steps of every length in every contact state of one body. Threads may share them: a step is made outside of any lock, and the
// first one made is kept.
class WholeTables {
 public:
  const WholeLayout at;
  const std::vector<double> lengths;  // [s], falling

  WholeTables(const Body& body, const Nodes& n, const std::vector<double>& steps)
      : at(body), lengths(steps), nodes(n), states(count(body)), made(states * lengths.size()) {
    for (size_t s = 0; s < states; s++) of_state.emplace_back(body, int(s));
    for (auto& one : made) one = nullptr;
  }
  ~WholeTables() {
    for (auto& one : made) delete one.load();
  }
  WholeTables(const WholeTables&) = delete;
  WholeTables& operator=(const WholeTables&) = delete;

  static size_t count(const Body& body) {
    size_t out = 1;
    for (size_t i = 0; i < body.legs.size(); i++) out *= CONTACTS;
    return out;
  }
  const WholeState& state(int number) const { return of_state[number]; }
  const WholeStep& of(int number, int k) const {
    std::atomic<WholeStep*>& place = made[size_t(k) * states + number];
    const WholeStep* found = place.load(std::memory_order_acquire);
    if (__builtin_expect(found != nullptr, 1)) return *found;
    WholeStep* mine = new WholeStep(make(number, k));
    WholeStep* none = nullptr;
    if (place.compare_exchange_strong(none, mine)) return *mine;
    delete mine;
    return *none;
  }

 private:
  const Nodes nodes;
  const size_t states;
  std::vector<WholeState> of_state;
  mutable std::vector<std::atomic<WholeStep*>> made;

  TARSUS_APART WholeStep make(int number, int k) const {
    int doublings = 0;
    double h = lengths[k];
    for (; h * of_state[number].system.rate > 0.5; h *= 0.5) doublings++;
    WholeMaker maker(of_state[number], nodes, h);
    for (int n = 0; n < doublings; n++) maker.double_length();
    return maker.step();
  }
};

// Those of the bodies that were run last on the same legs' tables.
class WholeShelf {
 public:
  // Of a body in gravity of one.
  std::shared_ptr<const WholeTables> of(const Body& body, const Nodes& nodes, const std::vector<double>& lengths) const {
    const std::vector<double> name = named(body);
    const std::lock_guard<std::mutex> guard(lock);
    for (const auto& one : kept) {
      if (one.first == name) return one.second;
    }
    if (kept.size() >= MOST) kept.erase(kept.begin());
    kept.emplace_back(name, std::make_shared<const WholeTables>(body, nodes, lengths));
    return kept.back().second;
  }

 private:
  static constexpr size_t MOST = 8;
  mutable std::mutex lock;
  mutable std::vector<std::pair<std::vector<double>, std::shared_ptr<const WholeTables>>> kept;

  static std::vector<double> named(const Body& body) {
    std::vector<double> out;
    for (const auto* part : {&body.mass, &body.weight, &body.gain, &body.load}) out.insert(out.end(), part->begin(), part->end());
    out.insert(out.end(), body.drive.begin(), body.drive.end());
    for (const Leg& leg : body.legs) {
      out.insert(out.end(), {leg.mass, leg.weight, double(leg.first), double(leg.last)});
      for (int d = 0; d < DIRECTIONS; d++) {
        out.insert(out.end(), {leg.stiffness[d], leg.damping[d], double(leg.hip[d].count)});
        for (int n = 0; n < leg.hip[d].count; n++) out.insert(out.end(), {double(leg.hip[d].at[n]), leg.hip[d].by[n]});
      }
    }
    return out;
  }
};

}  // namespace tarsus::legged
