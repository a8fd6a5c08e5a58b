// Dual numbers: values at the nodes and their P first derivatives, carried through every operation (forward
// differentiation): slopes of the laws, by their arguments.
//
// The value is computed exactly as without derivatives. A selection has the derivative of what it selects, a
// minimum that of the smaller, and what moves in jumps (floor, comparisons) has none.
#pragma once
#include "base/elementary.hpp"

namespace tarsus {

template <int P>
struct Dual {
  Row value;
  Row slope[P];

  Dual() = default;
  TARSUS_INLINE Dual(const Row& constant) : value(constant) {
    for (int p = 0; p < P; p++) slope[p] = Row(0.0);
  }
  // The variable that derivative ``place`` is with respect to.
  static TARSUS_INLINE Dual variable(const Row& at, int place) {
    Dual out(at);
    out.slope[place] = Row(1.0);
    return out;
  }
};

// A value whose slopes are rate_a * a.slope (+ rate_b * b.slope).
template <int P, class Rate>
TARSUS_INLINE Dual<P> chained(const Row& value, const Rate& rate, const Dual<P>& a) {
  Dual<P> out;
  out.value = value;
  for (int p = 0; p < P; p++) out.slope[p] = rate * a.slope[p];
  return out;
}

template <int P>
TARSUS_INLINE Dual<P> chained(const Row& value, const Row& rate_a, const Dual<P>& a,
                                    const Row& rate_b, const Dual<P>& b) {
  Dual<P> out;
  out.value = value;
  for (int p = 0; p < P; p++) out.slope[p] = rate_a * a.slope[p] + rate_b * b.slope[p];
  return out;
}

#define TARSUS_DUAL template <int P> TARSUS_INLINE Dual<P>
TARSUS_DUAL operator+(const Dual<P>& a, const Dual<P>& b) {
  Dual<P> out;
  out.value = a.value + b.value;
  for (int p = 0; p < P; p++) out.slope[p] = a.slope[p] + b.slope[p];
  return out;
}
TARSUS_DUAL operator-(const Dual<P>& a, const Dual<P>& b) {
  Dual<P> out;
  out.value = a.value - b.value;
  for (int p = 0; p < P; p++) out.slope[p] = a.slope[p] - b.slope[p];
  return out;
}
TARSUS_DUAL operator*(const Dual<P>& a, const Dual<P>& b) {
  return chained(a.value * b.value, b.value, a, a.value, b);
}
TARSUS_DUAL operator/(const Dual<P>& a, const Dual<P>& b) {
  Dual<P> out;
  out.value = a.value / b.value;
  const Row inverse = 1.0 / b.value;
  for (int p = 0; p < P; p++) out.slope[p] = (a.slope[p] - out.value * b.slope[p]) * inverse;
  return out;
}
TARSUS_DUAL operator-(const Dual<P>& a) {
  Dual<P> out;
  out.value = -a.value;
  for (int p = 0; p < P; p++) out.slope[p] = -a.slope[p];
  return out;
}

// With a number, which does not vary.
TARSUS_DUAL operator+(Dual<P> a, double b) {
  a.value = a.value + b;
  return a;
}
TARSUS_DUAL operator-(Dual<P> a, double b) {
  a.value = a.value - b;
  return a;
}
TARSUS_DUAL operator-(double a, const Dual<P>& b) {
  Dual<P> out = -b;
  out.value = a - b.value;
  return out;
}
TARSUS_DUAL operator*(const Dual<P>& a, double b) { return chained(a.value * b, b, a); }
TARSUS_DUAL operator+(double a, const Dual<P>& b) { return b + a; }
TARSUS_DUAL operator*(double a, const Dual<P>& b) { return b * a; }
TARSUS_DUAL operator/(const Dual<P>& a, double b) { return chained(a.value / b, 1.0 / b, a); }
TARSUS_DUAL operator/(double a, const Dual<P>& b) {
  const Row value = a / b.value;
  return chained(value, -value / b.value, b);
}

TARSUS_DUAL squared(const Dual<P>& a) {
  return chained(a.value * a.value, a.value + a.value, a);
}

// ---- comparisons and selections

#define TARSUS_DUAL_STILL_TWO(name) \
  TARSUS_DUAL name(const Dual<P>& a, const Dual<P>& b) { return {name(a.value, b.value)}; }
#define TARSUS_DUAL_STILL(name) \
  TARSUS_DUAL name(const Dual<P>& a) { return {name(a.value)}; }
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

template <int P>
TARSUS_INLINE Dual<P> chosen(const Row& test, const Dual<P>& then, const Dual<P>& other) {
  Dual<P> out;
  out.value = select(test, then.value, other.value);
  for (int p = 0; p < P; p++) out.slope[p] = select(test, then.slope[p], other.slope[p]);
  return out;
}
TARSUS_DUAL select(const Dual<P>& test, const Dual<P>& then, const Dual<P>& other) {
  return chosen(test.value, then, other);
}
TARSUS_DUAL minimum(const Dual<P>& a, const Dual<P>& b) {
  return chosen(less(b.value, a.value), b, a);
}
TARSUS_DUAL maximum(const Dual<P>& a, const Dual<P>& b) {
  return chosen(less(a.value, b.value), b, a);
}
TARSUS_DUAL magnitude(const Dual<P>& a) {
  return chained(magnitude(a.value), with_sign(Row(1.0), a.value), a);
}

// ---- functions: name, value v of x, its derivative

#define TARSUS_DUAL_FUNCTION(name, rate)                   \
  TARSUS_DUAL name(const Dual<P>& a) {               \
    const Row& x = a.value;                               \
    const Row v = name(x);                                \
    return chained(v, rate, a);             \
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
TARSUS_DUAL power(const Dual<P>& a, const Dual<P>& b) {
  const Row value = power(a.value, b.value);
  const Row by_base = b.value * power(a.value, b.value - 1.0);
  const Row by_exponent = select(value, value * logarithm(a.value), Row(0.0));  // of 0^b it is 0
  Dual<P> out;
  out.value = value;
  for (int p = 0; p < P; p++) {
    const Row first = select(a.slope[p], by_base * a.slope[p], Row(0.0));
    out.slope[p] = first + select(b.slope[p], by_exponent * b.slope[p], Row(0.0));
  }
  return out;
}
TARSUS_DUAL hypotenuse(const Dual<P>& a, const Dual<P>& b) {
  const Row value = hypotenuse(a.value, b.value);
  return chained(value, a.value / value, a, b.value / value, b);
}
TARSUS_DUAL arc_tangent_of(const Dual<P>& a, const Dual<P>& b) {
  const Row squares = a.value * a.value + b.value * b.value;
  return chained(arc_tangent_of(a.value, b.value), b.value / squares, a, -a.value / squares, b);
}
TARSUS_DUAL with_sign(const Dual<P>& a, const Dual<P>& b) {
  const Row one(1.0), rate = with_sign(one, a.value) * with_sign(one, b.value);
  return chained(with_sign(a.value, b.value), rate, a);
}
TARSUS_DUAL modulo(const Dual<P>& a, const Dual<P>& b) {
  const Row turns = -floor_divide(a.value, b.value);
  return chained(modulo(a.value, b.value), Row(1.0), a, turns, b);
}
TARSUS_DUAL remainder_towards_zero(const Dual<P>& a, const Dual<P>& b) {
  const Row turns = -truncated(a.value / b.value);
  return chained(remainder_towards_zero(a.value, b.value), Row(1.0), a, turns, b);
}
#undef TARSUS_DUAL

}  // namespace tarsus
