// Gauss-Lobatto nodes of a step and the constant matrices that act on nodal values; tarsus.core.nodes makes them.
#pragma once
#include <vector>

#include "base/simd.hpp"

namespace tarsus {

constexpr int SERIES = 20;  // Taylor terms over a step that resolves every mode: 1/20! = 4e-19

struct Nodes {
  double tau[N];            // scaled times of the nodes, 0 to 1
  double monomial[N][N];    // [c][j]: coefficient of s^c of the polynomial through nodal values
  double from_value[N][N];  // the same by nodal values: [j][c]
  double tail[N];           // highest Legendre coefficient: the truncation that controls the step
  double tail_before[N];    // the one before it
  double derivative[N][N];  // nodal values to nodal values of the derivative by the scaled time
  double once[N][N];        // [j][i]: integral from 0 to node i of the Lagrange polynomial of node j
  double twice[N][N];       // the same integrated twice
  double left[N][N], right[N][N];  // nodal values on the two halves of a step from those on the whole, [to][from]
  double partial[N][N][N];         // on [0, tau_j]: [j][to][from]
  double spacing;                  // widest of neighbouring nodes
  double series[SERIES][N];        // [n][a]: integral over [0, 1] of (1 - s)^n / n! times the polynomial of node a
  std::vector<double> gauss, gauss_weights;  // Gauss's points on [0, 1], good for polynomials up to degree 31

  Row times() const { return load(tau); }
  // Truncation of a polynomial given by its nodal values.
  double truncation(const Row& values) const { return std::fabs(total(values * load(tail))); }
  // The same of a drive, which may be far faster than a structure that is free: swings that are alike about the middle of a long step
  // have no coefficient of an odd degree. Of a sine that is missed by 1e-12 of it or more the one before is less than 120 times the
  // highest, so that nothing that is resolved is asked for more.
  double truncation_of_drive(const Row& values) const { return truncation_by_two(values, 1024.0); }
  // The same of values that may jump between two nodes: a jump up and down again, alike about the middle of the step, has no
  // coefficient of an odd degree. Of a polynomial that is resolved the one before is less than 16 times the highest.
  double truncation_of_jumps(const Row& values) const { return truncation_by_two(values, 16.0); }

  // The slope of a polynomial given by its nodal values, by the scaled time.
  Row slope(const Row& values) const {
    Row out = Row(0.0);
    for (int j = 0; j < N; j++) out.set(j, total(load(derivative[j]) * values));
    return out;
  }

 private:
  // The highest coefficient, or the one before it, which may be so many times larger.
  double truncation_by_two(const Row& values, double larger) const {
    return std::max(truncation(values), std::fabs(total(values * load(tail_before))) / larger);
  }
};

// Coefficients (N) of powers of the scaled time of the polynomial through nodal values.
inline Row powers_of(const Nodes& nodes, const double* values) { return combine(nodes.from_value[0], load(values)); }
inline void powers_of(const Nodes& nodes, const double* values, double* out) { store(out, powers_of(nodes, values)); }

// sum_c series[first + c] s^c for first + c < terms, and its derivative by s.
inline double horner(const double* series, int first, int terms, double s) {
  double value = series[terms - 1];
  for (int c = terms - 2; c >= first; c--) value = value * s + series[c];
  return value;
}

inline double horner_slope(const double* series, int first, int terms, double s) {
  double value = (terms - 1.0 - first) * series[terms - 1];
  for (int c = terms - 2; c > first; c--) value = value * s + (c - first) * series[c];
  return value;
}

}  // namespace tarsus
