// The derivative by a number of the structure itself: what its steps and its rows have of their own, at the run's own state and
// inputs, in the modal coordinates of each contact mode. All else follows as for every other number.
#pragma once
#include "derive/derived_mode.hpp"

namespace tarsus::modal {

// A number of the structure, and its lane.
struct Structural {
  DerivedBook* book;
  int lane;

  void add(double value, Row& to) const { to.set(lane, to[lane] + value); }
};

// What the state at the end of a whole step has of the number (state), from what enters the step.
inline void end_by_structure(const DerivedStep& step, const std::vector<int>& acting, const Entering<double>& from, std::vector<double>& to) {
  const int size = step.tables.sizes.state();
  end_of_step(step.tables, acting, from, to);  // whose own flow is zero
  for (int k = 0; k < size; k++) {
    const double* row = step.flow.data() + size_t(k) * size;
    for (int c = 0; c < size; c++) to[k] += row[c] * from.state[c];
  }
}

// The state at scaled time s of a step of class k, and what it has of the number, as within_step.
class InsideByStructure {
 public:
  std::vector<double> state, moved;

  explicit InsideByStructure(const Sizes& s) : room_(s) {}

  void find(DerivedBook& by, const Nodes& nodes, const ContactMode& mode, int k, double s,
            const std::vector<int>& acting, const Entering<double>& whole) {
    Book& book = by.book;
    const int size = mode.sizes.state();
    moved.assign(size, 0.0);
    room_.part = whole;
    while (mode.terms[k] == 0 && k + 1 < book.classes()) {
      k++;
      const StepClass& half = book.step(mode, k);
      if (s >= 0.5) {
        room_.left.state = room_.part.state;
        room_.left.sources = room_.part.sources;
        for (int i : acting) {
          for (int j = 0; j < N; j++) room_.left.input(i)[j] = weighted(load(nodes.left[j]), room_.part.input(i));
        }
        end_by_structure(by.step(mode, k), acting, room_.left, term_);
        const double* e = half.exponential;
        for (int b = 0, ns = size / 2; b < ns; b++) {
          term_[b] += moved[b] * e[b] + moved[ns + b] * e[ns + b];
          term_[ns + b] += moved[b] * e[2 * ns + b] + moved[ns + b] * e[3 * ns + b];
        }
        moved = term_;
      }
      halve(half, nodes, acting, room_, s);
    }
    series(by.mode(mode), nodes, mode, s, s * book.lengths[k], mode.terms[k], acting);
  }

 private:
  Inside<double> room_;
  std::vector<double> term_, own_, next_, following_;

  // Taylor's series over a span [s] of the part of a step that is in the room.
  void series(const DerivedMode& by, const Nodes& nodes, const ContactMode& mode, double s, double span, int terms,
              const std::vector<int>& acting) {
    const int size = mode.sizes.state(), ns = size / 2;
    const double* t = mode.blocks;
    const Entering<double>& from = room_.part;
    state = own_ = from.state;
    term_ = moved;
    double power = 1.0;
    const auto flow = [&](const std::vector<double>& x, double by_time, std::vector<double>& to) {
      to.resize(size);
      for (int b = 0; b < ns; b++) {
        to[b] = by_time * (x[b] * t[b] + x[ns + b] * t[ns + b]);
        to[ns + b] = by_time * (x[b] * t[2 * ns + b] + x[ns + b] * t[3 * ns + b]);
      }
    };
    for (int c = 0; c < std::max(terms, N + 2); c++, power *= s) {
      const double step = span / (c + 1);
      flow(own_, step, next_);
      flow(term_, step, following_);
      for (int r = 0; r < size; r++) {
        const double* row = by.coupling.data() + size_t(r) * size;
        double sum = 0.0;
        for (int d = 0; d < size; d++) sum += row[d] * own_[d];
        following_[r] += step * sum;
      }
      const auto push = [&](double value, const double* plain, const double* change) {
        for (int r = 0; r < size; r++) {
          next_[r] += value * plain[r];
          following_[r] += value * change[r];
        }
      };
      for (int i : acting) {
        if (c < N) push(weighted(load(nodes.monomial[c]) * (power * step), from.input(i)), mode.inputs + i * size, by.rows->inputs + i * size);
      }
      for (int q = 0; c == 0 && q < mode.sizes.sources(); q++) {
        push(from.sources[q] * step, mode.bias_inputs + q * size, by.rows->bias_inputs + q * size);
      }
      own_.swap(next_);
      term_.swap(following_);
      for (int r = 0; r < size; r++) {
        state[r] += own_[r];
        moved[r] += term_[r];
      }
    }
  }
};

// What a moment of a step shows of the number at a state that stays, as `show`.
inline void show_by_structure(const ContactMode& mode, const ContactMode& by, const Nodes& nodes, double length, double s,
                              const std::vector<int>& acting, const Entering<double>& from, const std::vector<double>& state,
                              Shown<double>& to) {
  const int m = mode.sizes.feet, n2 = 2 * mode.sizes.coordinates;
  const size_t size = state.size();
  show_feet(by, nodes, length, s, acting, from, state, to);  // of a held foot all that there is
  std::vector<double> modal = state, moved(size, 0.0);
  for (int i : acting) {
    for (size_t k = 0; k < size && i < m; k++) {
      modal[k] += to.value[i] * mode.beta[i * size + k];
      moved[k] += to.value[i] * by.beta[i * size + k];
    }
  }
  for (int i = 0; i < m; i++) {
    const size_t row = size_t(m + i) * size;
    to.resistive[i] = to.smooth[i] = 0.0;
    if (!mode.is_held[i]) to.rate[i] = dot(by.outputs + row, modal) + dot(mode.outputs + row, moved);
  }
  for (int r = 0; r < n2; r++) {
    to.place[r] = dot(by.to_physical + r * size, modal) + dot(mode.to_physical + r * size, moved) +
                  with_sources(from.sources, by.bias_offset, n2, r);
  }
}

}  // namespace tarsus::modal
