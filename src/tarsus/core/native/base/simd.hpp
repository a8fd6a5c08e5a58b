// A row: the values at the eight nodes of a step (or of eight trajectories) as machine vectors.
//
// One AVX-512 register, two of AVX, four of SSE or NEON, written as just so many vectors: gcc takes wider ones than the
// machine's apart through memory, which costs it more than half its speed.
#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#ifdef __AVX512F__
#include <immintrin.h>
#endif

#if defined(_MSC_VER) && !defined(__clang__)
#error "Rows are written with the vector extension of gcc and clang; build with clang-cl here."
#endif

#define TARSUS_INLINE inline __attribute__((always_inline))
#define TARSUS_APART __attribute__((noinline))

namespace tarsus {

constexpr int N = 8;
constexpr double INF = std::numeric_limits<double>::infinity();
constexpr double NOT_A_NUMBER = std::numeric_limits<double>::quiet_NaN();

#if defined(__AVX512F__)
constexpr int WIDTH = 8;
#elif defined(__AVX__)
constexpr int WIDTH = 4;
#else
constexpr int WIDTH = 2;
#endif
constexpr int PARTS = N / WIDTH;
typedef double Vector __attribute__((vector_size(8 * WIDTH)));
typedef double Loose __attribute__((vector_size(8 * WIDTH), aligned(8)));
typedef long long Bits __attribute__((vector_size(8 * WIDTH)));
typedef unsigned long long Words __attribute__((vector_size(8 * WIDTH)));  // whose sums wrap around

struct Row {
  Vector part[PARTS];

  Row() = default;
  TARSUS_INLINE Row(double value) {
    for (int p = 0; p < PARTS; p++) part[p] = value - Vector{};
  }
  TARSUS_INLINE double operator[](int j) const { return part[j / WIDTH][j % WIDTH]; }
  TARSUS_INLINE void set(int j, double value) { part[j / WIDTH][j % WIDTH] = value; }

#define TARSUS_OPERATOR(op)                                                  \
  friend TARSUS_INLINE Row operator op(const Row& a, const Row& b) {         \
    Row out;                                                                 \
    for (int p = 0; p < PARTS; p++) out.part[p] = a.part[p] op b.part[p];    \
    return out;                                                              \
  }                                                                          \
  friend TARSUS_INLINE Row operator op(const Row& a, double b) {             \
    Row out;                                                                 \
    for (int p = 0; p < PARTS; p++) out.part[p] = a.part[p] op b;            \
    return out;                                                              \
  }                                                                          \
  friend TARSUS_INLINE Row operator op(double a, const Row& b) {             \
    Row out;                                                                 \
    for (int p = 0; p < PARTS; p++) out.part[p] = a op b.part[p];            \
    return out;                                                              \
  }
  TARSUS_OPERATOR(+)
  TARSUS_OPERATOR(-)
  TARSUS_OPERATOR(*)
  TARSUS_OPERATOR(/)
#undef TARSUS_OPERATOR
  TARSUS_INLINE Row operator-() const {
    Row out;
    for (int p = 0; p < PARTS; p++) out.part[p] = -part[p];
    return out;
  }
  TARSUS_INLINE Row& operator+=(const Row& b) { return *this = *this + b; }
  TARSUS_INLINE Row& operator-=(const Row& b) { return *this = *this - b; }
  TARSUS_INLINE Row& operator*=(const Row& b) { return *this = *this * b; }
};

TARSUS_INLINE Row load(const double* at) {
  Row out;
  for (int p = 0; p < PARTS; p++) out.part[p] = *reinterpret_cast<const Loose*>(at + WIDTH * p);
  return out;
}

TARSUS_INLINE void store(double* at, const Row& row) {
  for (int p = 0; p < PARTS; p++) *reinterpret_cast<Loose*>(at + WIDTH * p) = row.part[p];
}

// The value of ``function`` at every node; for what has no vector form.
template <class F>
TARSUS_INLINE Row each(const Row& a, F&& function) {
  Row out;
  for (int j = 0; j < N; j++) out.set(j, function(a[j]));
  return out;
}

template <class F>
TARSUS_INLINE Row each(const Row& a, const Row& b, F&& function) {
  Row out;
  for (int j = 0; j < N; j++) out.set(j, function(a[j], b[j]));
  return out;
}

TARSUS_INLINE Row magnitude(const Row& a) {
  Row out;
  for (int p = 0; p < PARTS; p++) {
    const Bits sign = reinterpret_cast<Bits>(a.part[p]) & 0x7fffffffffffffffLL;
    out.part[p] = reinterpret_cast<Vector>(sign);
  }
  return out;
}

TARSUS_INLINE Row larger(const Row& a, const Row& b) {
  Row out;
  for (int p = 0; p < PARTS; p++) out.part[p] = a.part[p] > b.part[p] ? a.part[p] : b.part[p];
  return out;
}
TARSUS_INLINE double larger(double a, double b) { return a > b ? a : b; }
TARSUS_INLINE double smaller(double a, double b) { return a < b ? a : b; }

// Sum, largest and smallest of a row, taken in halves, as machines reduce a vector. The largest passes over NaN where
// another value follows, so ask ``finite`` where that matters. any_less: whether any a < b; any_not_below: whether any
// is not a <= b, which is true of NaN.
#ifdef __AVX512F__
TARSUS_INLINE double total(const Row& a) { return _mm512_reduce_add_pd((__m512d)a.part[0]); }
TARSUS_INLINE double highest(const Row& a) { return _mm512_reduce_max_pd((__m512d)a.part[0]); }
TARSUS_INLINE double lowest(const Row& a) { return _mm512_reduce_min_pd((__m512d)a.part[0]); }
TARSUS_INLINE bool any_less(const Row& a, const Row& b) {
  return _mm512_cmp_pd_mask((__m512d)a.part[0], (__m512d)b.part[0], _CMP_LT_OQ) != 0;
}
TARSUS_INLINE bool any_not_below(const Row& a, const Row& b) {
  return _mm512_cmp_pd_mask((__m512d)a.part[0], (__m512d)b.part[0], _CMP_NLE_UQ) != 0;
}
#else
TARSUS_INLINE double total(const Row& a) {
  return ((a[0] + a[4]) + (a[2] + a[6])) + ((a[1] + a[5]) + (a[3] + a[7]));
}
TARSUS_INLINE double highest(const Row& a) {
  return larger(larger(larger(a[0], a[4]), larger(a[2], a[6])), larger(larger(a[1], a[5]), larger(a[3], a[7])));
}
TARSUS_INLINE double lowest(const Row& a) {
  return smaller(smaller(smaller(a[0], a[4]), smaller(a[2], a[6])), smaller(smaller(a[1], a[5]), smaller(a[3], a[7])));
}
TARSUS_INLINE bool any(const Bits& a) {
  long long some = a[0];
  for (int j = 1; j < WIDTH; j++) some |= a[j];
  return some != 0;
}
TARSUS_INLINE bool any_less(const Row& a, const Row& b) {
  Bits some = a.part[0] < b.part[0];
  for (int p = 1; p < PARTS; p++) some |= a.part[p] < b.part[p];
  return any(some);
}
TARSUS_INLINE bool any_not_below(const Row& a, const Row& b) {
  Bits all = a.part[0] <= b.part[0];
  for (int p = 1; p < PARTS; p++) all &= a.part[p] <= b.part[p];
  return any(~all);
}
#endif

// 1/x and factor/x, to rounding. Where the machine guesses a reciprocal, two of Newton's steps take no longer than its
// division and leave the divider, which does one row in 16 cycles, out of it.
TARSUS_INLINE void reciprocals(const Row& x, const Row& factor, Row& inverse, Row& quotient) {
#ifdef __AVX512F__
  Row guess;
  guess.part[0] = (Vector)_mm512_rcp14_pd((__m512d)x.part[0]);
  guess += guess * (1.0 - x * guess);
  const Row rest = 1.0 - x * guess, scaled = factor * guess;
  inverse = guess + guess * rest;
  quotient = scaled + scaled * rest;
#else
  inverse = 1.0 / x;
  quotient = factor * inverse;
#endif
}

TARSUS_INLINE bool finite(const Row& a) { return std::isfinite(total(a)); }

// sum_j rows[j] x[j], rows of 8 one after the other: a matrix of 8 x 8, row j what a unit at node j gives.
TARSUS_INLINE Row combine(const double* rows, const Row& x) {
  Row even = load(rows) * x[0], odd = load(rows + N) * x[1];
  for (int j = 2; j < N; j += 2) {
    even += load(rows + N * j) * x[j];
    odd += load(rows + N * j + N) * x[j + 1];
  }
  return even + odd;
}

}  // namespace tarsus
