// Elementary functions of numbers and rows under one name each, as a law's program means them: comparisons
// give 1 or 0, nothing traps, and a row gives at every node what a number gives.
#pragma once
#include "base/simd.hpp"

namespace tarsus {

template <class Real>
TARSUS_INLINE Real squared(const Real& a) { return a * a; }
TARSUS_INLINE double select(double test, double then, double other) { return test != 0.0 ? then : other; }
TARSUS_INLINE double less(double a, double b) { return a < b ? 1.0 : 0.0; }
TARSUS_INLINE double less_equal(double a, double b) { return a <= b ? 1.0 : 0.0; }
TARSUS_INLINE double equal(double a, double b) { return a == b ? 1.0 : 0.0; }
TARSUS_INLINE double not_equal(double a, double b) { return a != b ? 1.0 : 0.0; }
// As Python's min and max: the first, unless the second is beyond it.
TARSUS_INLINE double minimum(double a, double b) { return b < a ? b : a; }
TARSUS_INLINE double maximum(double a, double b) { return b > a ? b : a; }
TARSUS_INLINE double magnitude(double a) { return std::fabs(a); }
TARSUS_INLINE double square_root(double a) { return std::sqrt(a); }
TARSUS_INLINE double floored(double a) { return std::floor(a); }
TARSUS_INLINE double ceiled(double a) { return std::ceil(a); }
TARSUS_INLINE double truncated(double a) { return std::trunc(a); }
TARSUS_INLINE double rounded(double a) { return std::nearbyint(a); }
TARSUS_INLINE double is_finite(double a) { return std::fabs(a) < INF ? 1.0 : 0.0; }
TARSUS_INLINE double is_nan(double a) { return a != a ? 1.0 : 0.0; }
TARSUS_INLINE double is_infinite(double a) { return std::fabs(a) == INF ? 1.0 : 0.0; }

// Remainder with the sign of the divisor, and the whole quotient that belongs to it: Python's % and //.
inline double modulo(double a, double b) {
  const double rest = std::fmod(a, b);
  if (rest == 0.0) return std::copysign(0.0, b);
  return (b < 0.0) != (rest < 0.0) ? rest + b : rest;
}

inline double floor_divide(double a, double b) {
  const double rest = std::fmod(a, b);
  double quotient = (a - rest) / b;
  if (rest != 0.0 && (b < 0.0) != (rest < 0.0)) quotient -= 1.0;
  if (quotient == 0.0) return std::copysign(0.0, a / b);
  const double whole = std::floor(quotient);
  return quotient - whole > 0.5 ? whole + 1.0 : whole;
}

#define TARSUS_ROW_COMPARISON(name, op)                                          \
  TARSUS_INLINE Row name(const Row& a, const Row& b) {                           \
    Row out;                                                                     \
    const Vector zero{}, one = 1.0 - zero;                                       \
    for (int p = 0; p < PARTS; p++) out.part[p] = a.part[p] op b.part[p] ? one : zero; \
    return out;                                                                  \
  }
TARSUS_ROW_COMPARISON(less, <)
TARSUS_ROW_COMPARISON(less_equal, <=)
TARSUS_ROW_COMPARISON(equal, ==)
TARSUS_ROW_COMPARISON(not_equal, !=)
#undef TARSUS_ROW_COMPARISON

TARSUS_INLINE Row select(const Row& test, const Row& then, const Row& other) {
  Row out;
  for (int p = 0; p < PARTS; p++) out.part[p] = test.part[p] != Vector{} ? then.part[p] : other.part[p];
  return out;
}

TARSUS_INLINE Row minimum(const Row& a, const Row& b) {
  Row out;
  for (int p = 0; p < PARTS; p++) out.part[p] = b.part[p] < a.part[p] ? b.part[p] : a.part[p];
  return out;
}

TARSUS_INLINE Row maximum(const Row& a, const Row& b) {
  Row out;
  for (int p = 0; p < PARTS; p++) out.part[p] = b.part[p] > a.part[p] ? b.part[p] : a.part[p];
  return out;
}

// The size of ``a`` with the sign of ``b``.
TARSUS_INLINE double with_sign(double a, double b) { return std::copysign(a, b); }
TARSUS_INLINE Row with_sign(const Row& a, const Row& b) {
  Row out;
  const long long size = 0x7fffffffffffffffLL;
  for (int p = 0; p < PARTS; p++) {
    const Bits own = reinterpret_cast<Bits>(a.part[p]) & size;
    const Bits sign = reinterpret_cast<Bits>(b.part[p]) & ~size;
    out.part[p] = reinterpret_cast<Vector>(own | sign);
  }
  return out;
}

TARSUS_INLINE Row is_finite(const Row& a) { return less(magnitude(a), Row(INF)); }
TARSUS_INLINE Row is_nan(const Row& a) { return not_equal(a, a); }
TARSUS_INLINE Row is_infinite(const Row& a) { return equal(magnitude(a), Row(INF)); }

// The value of a function at every node, through memory: setting the entries of a row one by one is slow.
template <class F>
TARSUS_INLINE Row at_nodes(const Row& a, F&& function) {
  alignas(64) double value[N];
  store(value, a);
  for (int j = 0; j < N; j++) value[j] = function(value[j]);
  return load(value);
}

// What the machine does to a whole vector: a loop that compilers turn into one instruction a part.
#define TARSUS_ROW_WHOLE(name) \
  TARSUS_INLINE Row name(const Row& a) { return at_nodes(a, [](double x) { return name(x); }); }
TARSUS_ROW_WHOLE(square_root)
TARSUS_ROW_WHOLE(floored)
TARSUS_ROW_WHOLE(ceiled)
TARSUS_ROW_WHOLE(truncated)
TARSUS_ROW_WHOLE(rounded)
#undef TARSUS_ROW_WHOLE

// Libraries mix instructions of old and new machines, which costs 200 ns a call while the upper halves of
// vector registers are in use (measured, glibc 2.36); compilers forget to clear them where a row comes by
// address. With AVX-512 some upper halves cannot be cleared, so what laws use most is computed here instead,
// see below.
TARSUS_INLINE void clear_upper_halves() {
#if defined(__AVX__)
  __builtin_ia32_vzeroupper();
#endif
}

// Those of the machine's mathematical library, node by node; apart, so that the rows around them stay in
// registers.
template <class F>
TARSUS_INLINE Row by_library(const Row& a, F&& function) {
  alignas(64) double value[N];
  store(value, a);
  clear_upper_halves();
  for (int j = 0; j < N; j++) value[j] = function(value[j]);
  return load(value);
}

template <class F>
TARSUS_INLINE Row by_library(const Row& a, const Row& b, F&& function) {
  alignas(64) double value[N], other[N];
  store(value, a);
  store(other, b);
  clear_upper_halves();
  for (int j = 0; j < N; j++) value[j] = function(value[j], other[j]);
  return load(value);
}

#define TARSUS_ONE(name, function)                                  \
  inline double name(double a) { return function(a); }              \
  TARSUS_APART inline Row name(const Row& a) { return by_library(a, [](double x) { return function(x); }); }
#define TARSUS_TWO(name, function)                                  \
  inline double name(double a, double b) { return function(a, b); } \
  TARSUS_APART inline Row name(const Row& a, const Row& b) {        \
    return by_library(a, b, [](double x, double y) { return function(x, y); }); \
  }
TARSUS_ONE(exponential_less_one, std::expm1)
TARSUS_ONE(binary_logarithm, std::log2)
TARSUS_ONE(decimal_logarithm, std::log10)
TARSUS_ONE(sine, std::sin)
TARSUS_ONE(cosine, std::cos)
TARSUS_ONE(tangent, std::tan)
TARSUS_ONE(arc_sine, std::asin)
TARSUS_ONE(arc_cosine, std::acos)
TARSUS_ONE(arc_tangent, std::atan)
TARSUS_ONE(hyperbolic_sine, std::sinh)
TARSUS_ONE(hyperbolic_cosine, std::cosh)
TARSUS_ONE(hyperbolic_tangent, std::tanh)
TARSUS_ONE(area_sine, std::asinh)
TARSUS_ONE(area_cosine, std::acosh)
TARSUS_ONE(area_tangent, std::atanh)
TARSUS_ONE(error_function, std::erf)
TARSUS_ONE(complementary_error_function, std::erfc)
TARSUS_TWO(power, std::pow)
TARSUS_TWO(hypotenuse, std::hypot)
TARSUS_TWO(arc_tangent_of, std::atan2)
TARSUS_TWO(remainder_towards_zero, std::fmod)
#undef TARSUS_ONE
#undef TARSUS_TWO
// ---- exponential and logarithm of rows, within one unit in the last place (methods of fdlibm)

inline double exponential(double a) { return std::exp(a); }
inline double logarithm(double a) { return std::log(a); }
inline double logarithm_of_one_plus(double a) { return std::log1p(a); }

constexpr double LN2_HIGH = 6.93147180369123816490e-01;  // 20 zeros at its end: exact times a small integer
constexpr double LN2_LOW = 1.90821492927058770002e-10;
constexpr double WHOLE = 6755399441055744.0;  // 1.5 * 2^52: added to a number, it leaves the whole part last

// x = k ln 2 + r, exp(r) by a rational approximation, times 2^k in two steps so that ends are reached gently.
TARSUS_APART inline Row exponential(const Row& a) {
  const Row x = minimum(maximum(a, Row(-746.0)), Row(710.0));
  Row out;
  for (int p = 0; p < PARTS; p++) {
    const Vector shifted = x.part[p] * 1.44269504088896338700 + WHOLE;
    const Vector k = shifted - WHOLE;
    const Bits whole = reinterpret_cast<Bits>(shifted) - reinterpret_cast<Bits>(WHOLE - Vector{});
    const Vector high = x.part[p] - k * LN2_HIGH, low = k * LN2_LOW, r = high - low, t = r * r;
    const Vector tail = -1.65339022054652515390e-06 + t * 4.13813679705723846039e-08;
    const Vector c = r - t * (1.66666666666666019037e-01 + t * (-2.77777777770155933842e-03 +
        t * (6.61375632143793436117e-05 + t * tail)));
    const Vector y = 1.0 - ((low - (r * c) / (2.0 - c)) - high);
    const Bits half = whole >> 1;
    const Vector first = reinterpret_cast<Vector>((half + 1023) << 52);
    out.part[p] = y * first * reinterpret_cast<Vector>((whole - half + 1023) << 52);
  }
  return out;
}

// x = 2^k (1 + f) with 1 + f between sqrt(1/2) and sqrt(2), log(1 + f) by a series in f / (2 + f).
TARSUS_APART inline Row logarithm(const Row& a) {
  Row out;
  for (int p = 0; p < PARTS; p++) {
    const Vector given = a.part[p];
    const Bits tiny = given < 2.2250738585072014e-308;
    const Vector x = tiny ? given * 18014398509481984.0 : given;  // 2^54
    const long long root = 0x3fe6a09e00000000LL, one = 0x3ff0000000000000LL;
    const Bits raised = reinterpret_cast<Bits>(reinterpret_cast<Words>(x) + static_cast<unsigned long long>(one - root));  // of NaN as well
    const Bits exponent = (raised >> 52) - 1023 - (tiny & 54);
    const Vector f = reinterpret_cast<Vector>((raised & 0x000fffffffffffffLL) + root) - 1.0;
    const Vector k = reinterpret_cast<Vector>(exponent + reinterpret_cast<Bits>(WHOLE - Vector{})) - WHOLE;
    const Vector square = 0.5 * f * f, s = f / (2.0 + f), z = s * s, w = z * z;
    const Vector even = w * (3.999999999940941908e-01 + w * (2.222219843214978396e-01 +
        w * 1.531383769920937332e-01));
    const Vector odd = z * (6.666666666666735130e-01 + w * (2.857142874366239149e-01 +
        w * (1.818357216161805012e-01 + w * 1.479819860511658591e-01)));
    Vector y = k * LN2_HIGH - ((square - (s * (square + (even + odd)) + k * LN2_LOW)) - f);
    y = given == 0.0 ? -INF - Vector{} : y;
    y = given < 0.0 ? NOT_A_NUMBER - Vector{} : y;
    out.part[p] = given < INF ? y : given;  // infinity and NaN stay what they are
  }
  return out;
}

// log(u) of the rounded sum u = 1 + x, and what rounding lost.
TARSUS_INLINE Row logarithm_of_one_plus(const Row& x) {
  const Row u = 1.0 + x, large = less(Row(1.0), x);
  const Row lost = select(large, 1.0 - (u - x), x - (u - 1.0));
  const Row main = logarithm(u), exact = less(Row(0.0), u) * less(u, Row(INF));
  return select(exact, main + lost / u, main);
}

TARSUS_APART inline Row modulo(const Row& a, const Row& b) {
  return by_library(a, b, [](double x, double y) { return modulo(x, y); });
}
TARSUS_APART inline Row floor_divide(const Row& a, const Row& b) {
  return by_library(a, b, [](double x, double y) { return floor_divide(x, y); });
}

}  // namespace tarsus
