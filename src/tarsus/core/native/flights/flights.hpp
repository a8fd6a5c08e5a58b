// Free flights of one linear structure near the ground, with derivatives: drive force, and film and attraction at the
// foot, whose forces run straight over a step.
//
// z' = flow z + inputs (F(t), f), f = -C g' / (g + g0)^n - C_e V^2 / (g + g_e)^2 along the foot's normal. A step is exact
// for forces that run straight between its ends; the force at the foot at its end is found by two corrections. A flight
// begins some time before or after its first sample, and is taken there by sixteen steps of the classical Runge-Kutta scheme. Every
// number has eight derivatives, those of just this arithmetic.
#pragma once
#include <cmath>
#include <vector>

#include "base/simd.hpp"

namespace tarsus {
namespace flights {

// A number and its derivatives.
struct Number {
  double value;
  Row slope;
};

TARSUS_INLINE Number operator+(const Number& a, const Number& b) { return {a.value + b.value, a.slope + b.slope}; }
TARSUS_INLINE Number operator*(double a, const Number& b) { return {a * b.value, a * b.slope}; }
TARSUS_INLINE Number operator*(const Number& a, const Number& b) {
  return {a.value * b.value, a.value * b.slope + b.value * a.slope};
}

// A structure of so many states, seen from its foot: flow (states, states), inputs (states, 2) by drive and foot, row
// (states / 2); maps over a step: free (states, states), first and last (states, 2) by the forces at its ends; output
// (channels, states): what is returned.
struct Structure {
  int states, channels;
  std::vector<double> flow, inputs, row, free, first, last, output;
};

// Forces at the foot: C, g0, C_e, g_e, n, whether n is another number than 3 or has derivatives, and the foot's gap at rest.
struct Foot {
  Number film[5];
  bool raised;
  double neutral;
};

constexpr int CORRECTIONS = 2, APPROACH_STEPS = 16;
// Part of a thickness that is left at least: trials of a fit may dip below the ground.
constexpr double LEAST = 0.2;

// 1 / (gap + thickness), the distance held above a part of the thickness.
TARSUS_INLINE Number near(const Number& gap, const Number& thickness) {
  const double least = LEAST * thickness.value, distance = gap.value + thickness.value;
  const bool held = distance < least;
  const double inverse = 1.0 / (held ? least : distance);
  const Row moved = held ? LEAST * thickness.slope : gap.slope + thickness.slope;
  return {inverse, (-inverse * inverse) * moved};
}

// base^exponent.
inline Number raised(const Number& base, const Number& exponent) {
  const double value = std::pow(base.value, exponent.value);
  return {value, (value * std::log(base.value)) * exponent.slope + (value * exponent.value / base.value) * base.slope};
}

TARSUS_INLINE Number force_at(const Foot& foot, const Number& gap, const Number& rate, double square) {
  const Number close = near(gap, foot.film[1]);
  const Number power = foot.raised ? raised(close, foot.film[4]) : close * close * close;
  Number force = (-1.0) * (foot.film[0] * power * rate);
  if (square != 0.0) {
    const Number away = near(gap, foot.film[3]);
    force = force + (-square) * (foot.film[2] * (away * away));
  }
  return force;
}

// One flight, its state and what it needs on the way; made once for all of a structure.
class Flight {
 public:
  explicit Flight(const Structure& structure)
      : s(structure), z(s.states), moved(s.states), k(4, std::vector<Number>(s.states)) {}

  std::vector<Number>& state() { return z; }

  // To the first sample, from ``begin`` [s] before or after it: force of the drive by a table of ``count`` values, ``step`` [s]
  // apart, the last one at the first sample, and offset[0] + offset[1] t.
  void approach(const Foot& foot, const Number& begin, const double* table, int count, double step, const Number* offset) {
    const Number h = (-1.0 / APPROACH_STEPS) * begin;
    Number early = drive(begin, table, count, step, offset);
    for (int n = 0; n < APPROACH_STEPS; n++) {
      const Number middle = drive(begin + (n + 0.5) * h, table, count, step, offset);
      const Number late = drive(begin + (n + 1.0) * h, table, count, step, offset);
      rate(foot, z, early, k[0]);
      rate(foot, ahead(0.5 * h, k[0]), middle, k[1]);
      rate(foot, ahead(0.5 * h, k[1]), middle, k[2]);
      rate(foot, ahead(h, k[2]), late, k[3]);
      const Number sixth = (1.0 / 6.0) * h;
      for (int i = 0; i < s.states; i++) z[i] = z[i] + sixth * (k[0][i] + 2.0 * k[1][i] + 2.0 * k[2][i] + k[3][i]);
      early = late;
    }
  }

  // ``samples`` of the output, ``every`` steps of ``step`` [s] apart: values (samples, channels), slopes (samples, channels, 8).
  void fly(const Foot& foot, const double* force, const double* squares, double step, const Number* offset, int samples,
           int every, double* values, double* slopes) {
    Number gap, speed;
    seen(foot, z, gap, speed);
    Number reaction = force_at(foot, gap, speed, squares == nullptr ? 0.0 : squares[0]);
    double by_gap = 0.0, by_speed = 0.0;
    const int half = s.states / 2;
    for (int i = 0; i < half; i++) {
      by_gap += s.row[i] * s.last[2 * i + 1];
      by_speed += s.row[i] * s.last[2 * (half + i) + 1];
    }
    report(values, slopes);
    for (int sample = 1, n = 0; sample < samples; sample++) {
      for (int e = 0; e < every; e++, n++) {
        const Number from = along(force[n], n * step, offset), to = along(force[n + 1], (n + 1) * step, offset);
        for (int i = 0; i < s.states; i++) {
          moved[i] = s.first[2 * i] * from + s.first[2 * i + 1] * reaction + s.last[2 * i] * to;
        }
        add_product(s.free, z, moved);
        seen(foot, moved, gap, speed);
        for (int c = 0; c < CORRECTIONS; c++) {
          reaction = force_at(foot, gap + by_gap * reaction, speed + by_speed * reaction, squares == nullptr ? 0.0 : squares[n + 1]);
        }
        for (int i = 0; i < s.states; i++) z[i] = moved[i] + s.last[2 * i + 1] * reaction;
      }
      report(values + sample * s.channels, slopes + sample * s.channels * N);
    }
  }

 private:
  static Number along(double force, double time, const Number* offset) {
    Number out = offset[0] + time * offset[1];
    out.value += force;
    return out;
  }

  static Number drive(const Number& time, const double* table, int count, double step, const Number* offset) {
    const double wanted = count - 1 + time.value / step, place = smaller(larger(wanted, 0.0), count - 1 - 1e-9);
    const int whole = int(place);
    const double rise = wanted < 0.0 ? 0.0 : (table[whole + 1] - table[whole]) / step;
    const Number by_table{table[whole] + (place - whole) * (table[whole + 1] - table[whole]), rise * time.slope};
    return by_table + offset[0] + time * offset[1];
  }

  void seen(const Foot& foot, const std::vector<Number>& at, Number& gap, Number& speed) const {
    const int half = s.states / 2;
    gap = {foot.neutral, Row(0.0)};
    speed = {0.0, Row(0.0)};
    for (int i = 0; i < half; i++) {
      gap = gap + s.row[i] * at[i];
      speed = speed + s.row[i] * at[half + i];
    }
  }

  const std::vector<Number>& ahead(const Number& h, const std::vector<Number>& slope) {
    for (int i = 0; i < s.states; i++) moved[i] = z[i] + h * slope[i];
    return moved;
  }

  void rate(const Foot& foot, const std::vector<Number>& at, const Number& force, std::vector<Number>& out) const {
    Number gap, speed;
    seen(foot, at, gap, speed);
    const Number reaction = force_at(foot, gap, speed, 0.0);
    for (int i = 0; i < s.states; i++) out[i] = s.inputs[2 * i] * force + s.inputs[2 * i + 1] * reaction;
    add_product(s.flow, at, out);
  }

  // to += matrix from, two rows of the matrix at a time: a sum waits for itself. ``from`` has an even number of states.
  static void add_product(const std::vector<double>& matrix, const std::vector<Number>& from, std::vector<Number>& to) {
    const int n = int(from.size());
    for (int i = 0; i < n; i += 2) {
      const double *one = matrix.data() + i * n, *other = one + n;
      Number even[2] = {to[i], to[i + 1]}, odd[2] = {{0.0, Row(0.0)}, {0.0, Row(0.0)}};
      for (int j = 0; j < n; j += 2) {
        even[0] = even[0] + one[j] * from[j];
        even[1] = even[1] + other[j] * from[j];
        odd[0] = odd[0] + one[j + 1] * from[j + 1];
        odd[1] = odd[1] + other[j + 1] * from[j + 1];
      }
      to[i] = even[0] + odd[0];
      to[i + 1] = even[1] + odd[1];
    }
  }

  void report(double* values, double* slopes) const {
    for (int c = 0; c < s.channels; c++) {
      Number sum{0.0, Row(0.0)};
      for (int j = 0; j < s.states; j++) sum = sum + s.output[c * s.states + j] * z[j];
      values[c] = sum.value;
      store(slopes + N * c, sum.slope);
    }
  }

  const Structure& s;
  std::vector<Number> z, moved;
  std::vector<std::vector<Number>> k;
};

}  // namespace flights
}  // namespace tarsus
