// Small dense systems of equations.
#pragma once
#include <cmath>
#include <utility>

#include "base/simd.hpp"

namespace tarsus {

// Solve a system of equations in place by Gauss elimination with row pivots: ``matrix`` has rows of
// ``stride`` numbers, of which the first ``size`` are coefficients and the next the right side, which becomes
// the solution. False where the matrix is singular.
inline bool eliminate(double* matrix, int size, int stride) {
  for (int c = 0; c < size; c++) {
    int best = c;
    for (int r = c + 1; r < size; r++) {
      if (std::fabs(matrix[r * stride + c]) > std::fabs(matrix[best * stride + c])) best = r;
    }
    double* pivot = matrix + c * stride;
    if (matrix[best * stride + c] == 0.0) return false;
    if (best != c) {
      double* other = matrix + best * stride;
      for (int j = c; j <= size; j++) std::swap(pivot[j], other[j]);
    }
    for (int r = c + 1; r < size; r++) {
      double* row = matrix + r * stride;
      const double factor = row[c] / pivot[c];
      if (factor == 0.0) continue;
      for (int j = c; j <= size; j++) row[j] -= factor * pivot[j];
    }
  }
  for (int r = size - 1; r >= 0; r--) {
    double* row = matrix + r * stride;
    double sum = row[size];
    for (int j = r + 1; j < size; j++) sum -= row[j] * matrix[j * stride + size];
    row[size] = sum / row[r];
  }
  return true;
}

// Columns of the inverse of a matrix of 8 x 8 given by its columns, which are used up; false where it is singular.
inline bool invert_columns(Row* left, Row* inverse) {
  for (int r = 0; r < N; r++) {
    inverse[r] = Row(0.0);
    inverse[r].set(r, 1.0);
  }
  for (int p = 0; p < N; p++) {
    int best = p;
    for (int r = p + 1; r < N; r++) {
      if (std::fabs(left[r][p]) > std::fabs(left[best][p])) best = r;
    }
    if (best != p) {
      std::swap(left[p], left[best]);
      std::swap(inverse[p], inverse[best]);
    }
    const double pivot = left[p][p];
    if (pivot == 0.0) return false;
    left[p] = left[p] * (1.0 / pivot);
    inverse[p] = inverse[p] * (1.0 / pivot);
    for (int r = 0; r < N; r++) {
      const double factor = left[r][p];
      if (r == p || factor == 0.0) continue;
      left[r] -= left[p] * factor;
      inverse[r] -= inverse[p] * factor;
    }
  }
  return true;
}

// load(BEHIND + N - 1 - c): 1 after place c of a row, load(AHEAD + N - c): 1 before it; 0 elsewhere.
alignas(64) constexpr double BEHIND[2 * N] = {0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 1, 1, 1};
alignas(64) constexpr double AHEAD[2 * N] = {1, 1, 1, 1, 1, 1, 1, 1, 0, 0, 0, 0, 0, 0, 0, 0};

// Least pivot of an elimination without row exchanges: each digit that a pivot lies below 1 costs the solution one, two at most
// here.
constexpr double LEAST_PIVOT = 1e-2;

// Solve a system of 8 x 8 given by its columns, which are used up, without row exchanges: ``rest`` becomes the solution. False
// where a pivot is small compared with 1.
TARSUS_INLINE bool solve_columns(Row* column, Row& rest) {
  double pivots[N];
#pragma GCC unroll 8
  for (int c = 0; c < N; c++) {
    if (!(std::fabs(column[c][c]) > LEAST_PIVOT)) return false;
    pivots[c] = 1.0 / column[c][c];
    const Row factor = column[c] * (load(BEHIND + N - 1 - c) * pivots[c]);
#pragma GCC unroll 8
    for (int d = c + 1; d < N; d++) column[d] -= factor * column[d][c];
    rest -= factor * rest[c];
  }
#pragma GCC unroll 8
  for (int c = N - 1; c >= 0; c--) {
    const double x = rest[c] * pivots[c];
    rest -= column[c] * (load(AHEAD + N - c) * x);
    rest.set(c, x);
  }
  return true;
}

}  // namespace tarsus
