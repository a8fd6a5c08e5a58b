// The motion of a whole walker of few legs within a step, at any moment: a power series.
#pragma once
#include "legged/whole.hpp"

namespace tarsus::legged {

constexpr int SERIES_TERMS = 40;
constexpr double SERIES_REACH = 3.0;  // largest rate times time over which the series keeps 14 digits

// State of the whole walker in the step being made, in powers of the scaled time from ``center`` on.
class Series {
 public:
  explicit Series(const Whole& s) : s_(s), size_(s.layout.size), rows_(s.layout.rows) {}

  // A step of class k was made.
  void restart(int k) {
    k_ = k;
    h_ = s_.tables.lengths[k];
    terms_ = 0;
    known_ = false;
  }
  // Have the series hold from scaled time ``low`` to ``high``.
  void cover(double low, double high) {
    if (covers(low) && covers(high)) return;
    expand(covered_from_start(high) ? 0.0 : low, high);
  }
  // State at a scaled time.
  void state_at(double time, Row* out) {
    cover_near(time);
    const double x = time - center_;
    for (int r = 0; r < rows_; r++) out[r] = term_[terms_ - 1][r];
    for (int c = terms_ - 2; c >= 0; c--) {
      for (int r = 0; r < rows_; r++) out[r] = out[r] * x + term_[c][r];
    }
  }
  // A number of the state and its derivative by the scaled time.
  Motion number(int n, double time) {
    cover_near(time);
    const double x = time - center_;
    double value = at(terms_ - 1, n), slope = 0.0;
    for (int c = terms_ - 2; c >= 0; c--) {
      slope = slope * x + value;
      value = value * x + at(c, n);
    }
    return {value, slope};
  }

 private:
  const Whole& s_;
  const int size_, rows_;
  int k_ = 0, terms_ = 0;
  double h_ = 0.0, center_ = 0.0;
  bool known_ = false;                 // whether the powers below are those of the step
  double power_[MOST_INPUTS][N];       // of every input, in powers of the scaled time
  Row term_[SERIES_TERMS][WHOLE_ROWS];

  double rate() const { return s_.whole->state(s_.state).system.rate * h_; }
  bool covered_from_start(double time) const { return time * rate() <= SERIES_REACH; }
  bool covers(double time) const { return terms_ > 0 && std::fabs(time - center_) * rate() <= reach_; }
  double at(int c, int n) const { return reinterpret_cast<const double*>(&term_[c][0])[n]; }
  double reach_ = 0.0;

  void cover_near(double time) {
    if (!covers(time)) expand(covered_from_start(time) ? 0.0 : time, time + SERIES_REACH / rate());
  }

  void find_powers() {
    known_ = true;
    const WholeLayout& of = s_.layout;
    for (int b = 0; b < of.inputs; b++) std::fill(power_[b], power_[b] + N, 0.0);
    power_[0][0] = s_.gravity;
    for (int d = 0; d < of.drives; d++) {
      if (s_.level[d]) {
        power_[of.drive(d)][0] = s_.channels[d][0];
      } else {
        store(power_[of.drive(d)], s_.powers(s_.channels[d]));
      }
    }
    for (int b = of.first_slot; b < of.inputs; b++) {
      if (s_.acts[b]) store(power_[b], s_.powers(s_.force[b]));
    }
  }

  bool moves(int b) const { return b < s_.layout.first_slot ? b > 0 && !s_.level[b - 1] : s_.acts[b]; }

  // The series from a state on, the inputs being powers of the time from there, as far as ``span``.
  void develop(const Row* from, double (*power)[N], double span) {
    const WholeState& equations = s_.whole->state(s_.state);
    const double x = std::min(rate() * span, SERIES_REACH);
    terms_ = N + 2;
    double size = 1.0;
    for (int c = 1; c < terms_; c++) size *= x / c;
    for (; size > 1e-18 && terms_ < SERIES_TERMS; terms_++) size *= x / terms_;
    for (int r = 0; r < rows_; r++) term_[0][r] = from[r];
    for (int c = 0; c + 1 < terms_; c++) {
      Row next[WHOLE_ROWS];
      for (int r = 0; r < rows_; r++) next[r] = Row(0.0);
      apply(equations.flow.data(), size_, rows_, term_[c], next);
      for (int b = 0; c < N && b < s_.layout.inputs; b++) {
        if (c > 0 && !moves(b)) continue;
        for (int r = 0; r < rows_; r++) next[r] += equations.input[b * rows_ + r] * power[b][c];
      }
      for (int r = 0; r < rows_; r++) term_[c + 1][r] = next[r] * (h_ / (c + 1));
    }
    reach_ = x * (1.0 + 1e-12);
  }

  // Over a whole step of a shorter class, ``width`` of this one.
  void by_table(int k, double width, double (*power)[N], Row* state) {
    const WholeLayout& of = s_.layout;
    const WholeStep& step = s_.step_of(k);
    Row sum[MOST_WIDTH];
    double constant[MOST_INPUTS];
    for (int r = 0; r < of.width; r++) sum[r] = Row(0.0);
    s_.add_columns(step, 0, reinterpret_cast<const double*>(state), size_, sum);
    for (int b = 0; b < of.first_slot; b++) constant[b] = moves(b) ? 0.0 : power[b][0];
    s_.add_columns(step, of.constant(0), constant, of.first_slot, sum);
    const Row time = s_.nodes.times() * width;
    for (int b = 1; b < of.inputs; b++) {
      if (!moves(b)) continue;
      Row value = Row(power[b][N - 1]);
      for (int c = N - 2; c >= 0; c--) value = value * time + power[b][c];
      s_.add_columns(step, of.nodal(b), reinterpret_cast<const double*>(&value), N, sum);
    }
    for (int r = 0; r < rows_; r++) state[r] = sum[of.outputs + r];
  }

  void expand(double center, double high) {
    if (!known_) find_powers();
    Row from[WHOLE_ROWS];
    for (int r = 0; r < rows_; r++) from[r] = load(s_.y + N * r);
    if (center == 0.0) {
      center_ = 0.0;
      return develop(from, power_, high);
    }
    double power[MOST_INPUTS][N];
    std::copy(power_[0], power_[0] + s_.layout.inputs * N, power[0]);
    const auto go_on = [&](double by) {
      for (int b = 1; b < s_.layout.inputs; b++) {
        if (moves(b)) shift(power[b], by);
      }
    };
    double left = center, width = 0.5;
    for (int k = k_ + 1; rate() * left > SERIES_REACH && k < s_.tables.classes(); k++, width *= 0.5) {
      if (width > left) continue;
      by_table(k, width, power, from);
      left -= width;
      go_on(width);
    }
    if (left > 0.0) {
      center_ = center - left;
      develop(from, power, left);
      state_at(center, from);
      go_on(left);
    }
    center_ = center;
    develop(from, power, high - center);
  }
};

}  // namespace tarsus::legged
