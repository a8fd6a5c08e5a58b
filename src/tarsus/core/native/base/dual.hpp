// Dual numbers: a value and its P first derivatives, carried through every operation (forward
// differentiation).
//
// The value is computed exactly as without derivatives. A selection has the derivative of what it selects, a
// minimum that of the smaller, and what moves in jumps (floor, comparisons) has none.
#pragma once
#include "base/elementary.hpp"

namespace tarsus {

template <class Real, int P>
struct Dual {
  Real value;
  Real slope[P];

  Dual() = default;
  TARSUS_INLINE Dual(const Real& constant) : value(constant) {
    for (int p = 0; p < P; p++) slope[p] = Real(0.0);
  }
  // The variable that derivative ``place`` is with respect to.
  static TARSUS_INLINE Dual variable(const Real& at, int place) {
    Dual out(at);
    out.slope[place] = Real(1.0);
    return out;
  }
};

// A number without its derivatives, and the derivatives without the value.
inline double value_of(double a) { return a; }
template <int P>
TARSUS_INLINE double value_of(const Dual<double, P>& a) {
  return a.value;
}
// Whether it is zero with all of its derivatives.
inline bool is_nothing(double a) { return a == 0.0; }
template <int P>
TARSUS_INLINE bool is_nothing(const Dual<double, P>& a) {
  bool out = a.value == 0.0;
  for (int p = 0; p < P; p++) out = out && a.slope[p] == 0.0;
  return out;
}
template <class Real, int P>
TARSUS_INLINE Dual<Real, P> without_value(Dual<Real, P> a) {
  a.value = Real(0.0);
  return a;
}

// A value whose slopes are rate_a * a.slope (+ rate_b * b.slope).
template <class Real, int P, class Rate>
TARSUS_INLINE Dual<Real, P> chained(const Real& value, const Rate& rate, const Dual<Real, P>& a) {
  Dual<Real, P> out;
  out.value = value;
  for (int p = 0; p < P; p++) out.slope[p] = rate * a.slope[p];
  return out;
}

template <class Real, int P>
TARSUS_INLINE Dual<Real, P> chained(const Real& value, const Real& rate_a, const Dual<Real, P>& a,
                                    const Real& rate_b, const Dual<Real, P>& b) {
  Dual<Real, P> out;
  out.value = value;
  for (int p = 0; p < P; p++) out.slope[p] = rate_a * a.slope[p] + rate_b * b.slope[p];
  return out;
}

#define TARSUS_DUAL template <class Real, int P> TARSUS_INLINE Dual<Real, P>
TARSUS_DUAL operator+(const Dual<Real, P>& a, const Dual<Real, P>& b) {
  Dual<Real, P> out;
  out.value = a.value + b.value;
  for (int p = 0; p < P; p++) out.slope[p] = a.slope[p] + b.slope[p];
  return out;
}
TARSUS_DUAL operator-(const Dual<Real, P>& a, const Dual<Real, P>& b) {
  Dual<Real, P> out;
  out.value = a.value - b.value;
  for (int p = 0; p < P; p++) out.slope[p] = a.slope[p] - b.slope[p];
  return out;
}
TARSUS_DUAL operator*(const Dual<Real, P>& a, const Dual<Real, P>& b) {
  return chained(a.value * b.value, b.value, a, a.value, b);
}
TARSUS_DUAL operator/(const Dual<Real, P>& a, const Dual<Real, P>& b) {
  Dual<Real, P> out;
  out.value = a.value / b.value;
  const Real inverse = 1.0 / b.value;
  for (int p = 0; p < P; p++) out.slope[p] = (a.slope[p] - out.value * b.slope[p]) * inverse;
  return out;
}
TARSUS_DUAL operator-(const Dual<Real, P>& a) {
  Dual<Real, P> out;
  out.value = -a.value;
  for (int p = 0; p < P; p++) out.slope[p] = -a.slope[p];
  return out;
}

// With what does not vary, a double or a value of Real.
#define TARSUS_WITH_PLAIN(B)                                                                       \
  TARSUS_DUAL operator+(Dual<Real, P> a, const B& b) { a.value = a.value + b; return a; }          \
  TARSUS_DUAL operator-(Dual<Real, P> a, const B& b) { a.value = a.value - b; return a; }          \
  TARSUS_DUAL operator-(const B& a, const Dual<Real, P>& b) {                                      \
    Dual<Real, P> out = -b;                                                                        \
    out.value = a - b.value;                                                                       \
    return out;                                                                                    \
  }                                                                                                \
  TARSUS_DUAL operator*(const Dual<Real, P>& a, const B& b) {                                      \
    return chained<Real, P, B>(a.value * b, b, a);                                                 \
  }                                                                                                \
  TARSUS_DUAL operator+(const B& a, const Dual<Real, P>& b) { return b + a; }                      \
  TARSUS_DUAL operator*(const B& a, const Dual<Real, P>& b) { return b * a; }                      \
  TARSUS_DUAL operator/(const Dual<Real, P>& a, const B& b) {                                      \
    return chained<Real, P, B>(a.value / b, 1.0 / b, a);                                           \
  }                                                                                                \
  TARSUS_DUAL operator/(const B& a, const Dual<Real, P>& b) {                                      \
    const Real value = a / b.value;                                                                \
    return chained<Real, P, Real>(value, -value / b.value, b);                                     \
  }
TARSUS_WITH_PLAIN(double)
#undef TARSUS_WITH_PLAIN
#define TARSUS_WITH_ROW(op)                                                                        \
  template <int P> TARSUS_INLINE Dual<Row, P> operator op(const Dual<Row, P>& a, const Row& b) {   \
    return a op Dual<Row, P>(b);                                                                   \
  }                                                                                                \
  template <int P> TARSUS_INLINE Dual<Row, P> operator op(const Row& a, const Dual<Row, P>& b) {   \
    return Dual<Row, P>(a) op b;                                                                   \
  }
TARSUS_WITH_ROW(+)
TARSUS_WITH_ROW(-)
TARSUS_WITH_ROW(*)
TARSUS_WITH_ROW(/)
#undef TARSUS_WITH_ROW

TARSUS_DUAL squared(const Dual<Real, P>& a) {
  return chained<Real, P, Real>(a.value * a.value, a.value + a.value, a);
}

// ---- comparisons and selections

#define TARSUS_DUAL_STILL_TWO(name) \
  TARSUS_DUAL name(const Dual<Real, P>& a, const Dual<Real, P>& b) { return {name(a.value, b.value)}; }
#define TARSUS_DUAL_STILL(name) \
  TARSUS_DUAL name(const Dual<Real, P>& a) { return {name(a.value)}; }
TARSUS_DUAL_STILL_TWO(less)
TARSUS_DUAL_STILL_TWO(less_equal)
TARSUS_DUAL_STILL_TWO(equal)
TARSUS_DUAL_STILL_TWO(not_equal)
TARSUS_DUAL_STILL_TWO(floor_divide)
TARSUS_DUAL_STILL(floored)
TARSUS_DUAL_STILL(ceiled)
TARSUS_DUAL_STILL(truncated)
TARSUS_DUAL_STILL(rounded)
TARSUS_DUAL_STILL(is_finite)
TARSUS_DUAL_STILL(is_nan)
TARSUS_DUAL_STILL(is_infinite)
#undef TARSUS_DUAL_STILL_TWO
#undef TARSUS_DUAL_STILL

template <class Real, int P>
TARSUS_INLINE Dual<Real, P> chosen(const Real& test, const Dual<Real, P>& then, const Dual<Real, P>& other) {
  Dual<Real, P> out;
  out.value = select(test, then.value, other.value);
  for (int p = 0; p < P; p++) out.slope[p] = select(test, then.slope[p], other.slope[p]);
  return out;
}
TARSUS_DUAL select(const Dual<Real, P>& test, const Dual<Real, P>& then, const Dual<Real, P>& other) {
  return chosen(test.value, then, other);
}
TARSUS_DUAL minimum(const Dual<Real, P>& a, const Dual<Real, P>& b) {
  return chosen(less(b.value, a.value), b, a);
}
TARSUS_DUAL maximum(const Dual<Real, P>& a, const Dual<Real, P>& b) {
  return chosen(less(a.value, b.value), b, a);
}
TARSUS_DUAL magnitude(const Dual<Real, P>& a) {
  return chained<Real, P, Real>(magnitude(a.value), with_sign(Real(1.0), a.value), a);
}

// ---- functions: name, value v of x, its derivative

#define TARSUS_DUAL_FUNCTION(name, rate)                   \
  TARSUS_DUAL name(const Dual<Real, P>& a) {               \
    const Real& x = a.value;                               \
    const Real v = name(x);                                \
    return chained<Real, P, Real>(v, rate, a);             \
  }
TARSUS_DUAL_FUNCTION(square_root, 0.5 / v)
TARSUS_DUAL_FUNCTION(exponential, v)
TARSUS_DUAL_FUNCTION(exponential_less_one, v + 1.0)
TARSUS_DUAL_FUNCTION(logarithm, 1.0 / x)
TARSUS_DUAL_FUNCTION(logarithm_of_one_plus, 1.0 / (x + 1.0))
TARSUS_DUAL_FUNCTION(binary_logarithm, 1.4426950408889634 / x)
TARSUS_DUAL_FUNCTION(decimal_logarithm, 0.4342944819032518 / x)
TARSUS_DUAL_FUNCTION(sine, cosine(x))
TARSUS_DUAL_FUNCTION(cosine, -sine(x))
TARSUS_DUAL_FUNCTION(tangent, v * v + 1.0)
TARSUS_DUAL_FUNCTION(arc_sine, 1.0 / square_root(1.0 - x * x))
TARSUS_DUAL_FUNCTION(arc_cosine, -1.0 / square_root(1.0 - x * x))
TARSUS_DUAL_FUNCTION(arc_tangent, 1.0 / (x * x + 1.0))
TARSUS_DUAL_FUNCTION(hyperbolic_sine, hyperbolic_cosine(x))
TARSUS_DUAL_FUNCTION(hyperbolic_cosine, hyperbolic_sine(x))
TARSUS_DUAL_FUNCTION(hyperbolic_tangent, 1.0 - v * v)
TARSUS_DUAL_FUNCTION(area_sine, 1.0 / square_root(x * x + 1.0))
TARSUS_DUAL_FUNCTION(area_cosine, 1.0 / (square_root(x - 1.0) * square_root(x + 1.0)))
TARSUS_DUAL_FUNCTION(area_tangent, 1.0 / (1.0 - x * x))
TARSUS_DUAL_FUNCTION(error_function, 1.1283791670955126 * exponential(-(x * x)))
TARSUS_DUAL_FUNCTION(complementary_error_function, -1.1283791670955126 * exponential(-(x * x)))
#undef TARSUS_DUAL_FUNCTION

// Where base or exponent does not vary, its logarithm or quotient may be infinite and must not enter.
TARSUS_DUAL power(const Dual<Real, P>& a, const Dual<Real, P>& b) {
  const Real value = power(a.value, b.value);
  const Real by_base = b.value * power(a.value, b.value - 1.0);
  const Real by_exponent = select(value, value * logarithm(a.value), Real(0.0));  // of 0^b it is 0
  Dual<Real, P> out;
  out.value = value;
  for (int p = 0; p < P; p++) {
    const Real first = select(a.slope[p], by_base * a.slope[p], Real(0.0));
    out.slope[p] = first + select(b.slope[p], by_exponent * b.slope[p], Real(0.0));
  }
  return out;
}
TARSUS_DUAL hypotenuse(const Dual<Real, P>& a, const Dual<Real, P>& b) {
  const Real value = hypotenuse(a.value, b.value);
  return chained(value, a.value / value, a, b.value / value, b);
}
TARSUS_DUAL arc_tangent_of(const Dual<Real, P>& a, const Dual<Real, P>& b) {
  const Real squares = a.value * a.value + b.value * b.value;
  return chained(arc_tangent_of(a.value, b.value), b.value / squares, a, -a.value / squares, b);
}
TARSUS_DUAL with_sign(const Dual<Real, P>& a, const Dual<Real, P>& b) {
  const Real one(1.0), rate = with_sign(one, a.value) * with_sign(one, b.value);
  return chained<Real, P, Real>(with_sign(a.value, b.value), rate, a);
}
TARSUS_DUAL modulo(const Dual<Real, P>& a, const Dual<Real, P>& b) {
  const Real turns = -floor_divide(a.value, b.value);
  return chained(modulo(a.value, b.value), Real(1.0), a, turns, b);
}
TARSUS_DUAL remainder_towards_zero(const Dual<Real, P>& a, const Dual<Real, P>& b) {
  const Real turns = -truncated(a.value / b.value);
  return chained(remainder_towards_zero(a.value, b.value), Real(1.0), a, turns, b);
}
#undef TARSUS_DUAL

}  // namespace tarsus
