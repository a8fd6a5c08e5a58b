// Linear algebra of small matrices with a fixed order of operations: see tarsus/base/linear.py, which says what each is for.
// Compiled without fused multiplications, so that every machine makes the same bits. Matrices are rows one after the other.
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/complex.h>
#include <nanobind/stl/tuple.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <functional>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <tuple>
#include <vector>

#include "processor.hpp"

namespace nb = nanobind;

namespace {

typedef std::complex<double> Complex;
constexpr double EPS = std::numeric_limits<double>::epsilon();
constexpr int SWEEPS = 60;  // of Jacobi's method at most: it converges quadratically, in five to twenty
constexpr int ROUNDS = 60;  // QR steps at most for one eigenvalue, two to four on average

// With neither the library's care for infinities nor its other order.
Complex times(Complex a, Complex b) {
  return {a.real() * b.real() - a.imag() * b.imag(), a.real() * b.imag() + a.imag() * b.real()};
}
double times(double a, double b) { return a * b; }
double square(Complex a) { return a.real() * a.real() + a.imag() * a.imag(); }
double size(Complex a) { return std::sqrt(square(a)); }
double size(double a) { return std::fabs(a); }
Complex over(Complex a, Complex b) {
  const double squared = square(b);
  const Complex top = times(a, std::conj(b));
  return {top.real() / squared, top.imag() / squared};
}
double over(double a, double b) { return a / b; }

template <class T>
struct Matrix {
  size_t rows, columns;
  std::vector<T> values;
  Matrix(size_t n, size_t m) : rows(n), columns(m), values(n * m) {}
  T* operator[](size_t i) { return values.data() + i * columns; }
  const T* operator[](size_t i) const { return values.data() + i * columns; }
  static Matrix identity(size_t n) {
    Matrix out(n, n);
    for (size_t i = 0; i < n; i++) out[i][i] = T(1.0);
    return out;
  }
};

template <class T>
using Given = nb::ndarray<const T, nb::ndim<2>, nb::c_contig, nb::device::cpu>;

template <class T>
Matrix<T> copied(const Given<T>& a) {
  Matrix<T> out(a.shape(0), a.shape(1));
  std::copy(a.data(), a.data() + a.size(), out.values.begin());
  return out;
}

// A numpy array of this shape, without copying.
template <class T>
nb::object returned(std::vector<T>&& values, size_t dimensions, const size_t* shape) {
  auto* kept = new std::vector<T>(std::move(values));
  nb::capsule owner(kept, [](void* p) noexcept { delete static_cast<std::vector<T>*>(p); });
  return nb::cast(nb::ndarray<T, nb::numpy>(kept->data(), dimensions, shape, owner));
}

template <class T>
nb::object returned(std::vector<T>&& values, std::initializer_list<size_t> shape) {
  return returned(std::move(values), shape.size(), shape.begin());
}

template <class T>
nb::object returned(std::vector<T>&& values) {
  const size_t n = values.size();
  return returned(std::move(values), {n});
}

template <class T>
nb::object returned(Matrix<T>&& a) {
  return returned(std::move(a.values), {a.rows, a.columns});
}

// Of an array (..., k) and (k, m) or (k).
template <class T>
nb::object product(nb::ndarray<const T, nb::c_contig, nb::device::cpu> a, nb::ndarray<const T, nb::c_contig, nb::device::cpu> b) {
  if (a.ndim() == 0 || b.ndim() == 0 || b.ndim() > 2 || b.shape(0) != a.shape(a.ndim() - 1)) {
    throw std::invalid_argument("matrices of these sizes have no product");
  }
  const size_t depth = b.shape(0), m = b.ndim() == 2 ? b.shape(1) : 1;
  std::vector<size_t> shape;
  for (size_t d = 0; d + 1 < a.ndim(); d++) shape.push_back(a.shape(d));
  const size_t n = std::accumulate(shape.begin(), shape.end(), size_t(1), std::multiplies<size_t>());
  if (b.ndim() == 2) shape.push_back(m);
  Matrix<T> out(n, m);
  for (size_t i = 0; i < n; i++) {
    for (size_t k = 0; k < depth; k++) {
      const T factor = a.data()[i * depth + k];
      const T* row = b.data() + k * m;
      T* to = out[i];
      for (size_t j = 0; j < m; j++) to[j] += times(factor, row[j]);
    }
  }
  if (shape.empty()) return nb::cast(out.values[0]);
  return returned(std::move(out.values), shape.size(), shape.data());
}

// Size of the largest eigenvalue, to some per cent, by the power method.
double largest_of(Given<double> a) {
  const size_t n = a.shape(0);
  std::vector<double> x(n), next(n);
  for (size_t i = 0; i < n; i++) x[i] = 1.0 + double(i % 3);  // no motion of a regular structure is orthogonal to it
  double most = 0.0;
  for (int count = 0; count < 40; count++) {
    most = 0.0;
    for (size_t i = 0; i < n; i++) {
      next[i] = 0.0;
      for (size_t k = 0; k < n; k++) next[i] += a.data()[i * n + k] * x[k];
      most = std::max(most, std::fabs(next[i]));
    }
    if (most == 0.0) break;
    for (size_t i = 0; i < n; i++) x[i] = next[i] / most;
  }
  return most;
}

// x of a x = b by elimination with partial pivoting; None where a pivot is zero.
template <class T>
nb::object solve(Given<T> given, Given<T> right) {
  Matrix<T> a = copied(given), x = copied(right);
  const size_t n = a.rows, m = x.columns;
  if (a.columns != n || x.rows != n) throw std::invalid_argument("equations need a square matrix and as many right sides");
  for (size_t k = 0; k < n; k++) {
    size_t best = k;
    for (size_t i = k + 1; i < n; i++)
      if (size(a[i][k]) > size(a[best][k])) best = i;
    if (size(a[best][k]) == 0.0) return nb::none();
    if (best != k) {
      std::swap_ranges(a[k], a[k] + n, a[best]);
      std::swap_ranges(x[k], x[k] + m, x[best]);
    }
    for (size_t i = k + 1; i < n; i++) {
      const T factor = over(a[i][k], a[k][k]);
      if (factor == T(0.0)) continue;
      for (size_t j = k + 1; j < n; j++) a[i][j] -= times(factor, a[k][j]);
      for (size_t j = 0; j < m; j++) x[i][j] -= times(factor, x[k][j]);
    }
  }
  for (size_t k = n; k-- > 0;) {
    for (size_t j = 0; j < m; j++) x[k][j] = over(x[k][j], a[k][k]);
    for (size_t i = 0; i < k; i++)
      for (size_t j = 0; j < m; j++) x[i][j] -= times(a[i][k], x[k][j]);
  }
  return returned(std::move(x));
}

// Cosine and sine that make ``between`` zero in [[p, between], [between, q]].
std::pair<double, double> rotation(double p, double q, double between) {
  const double tau = 0.5 * (q - p), whole = std::fabs(tau) + std::sqrt(tau * tau + between * between);
  const double tangent = whole > 0.0 ? (tau < 0.0 ? -between : between) / whole : 0.0;
  const double cosine = 1.0 / std::sqrt(1.0 + tangent * tangent);
  return {cosine, tangent * cosine};
}

void turn(Matrix<double>& a, size_t p, size_t q, double cosine, double sine) {  // two columns
  for (size_t i = 0; i < a.rows; i++) {
    const double first = a[i][p], second = a[i][q];
    a[i][p] = cosine * first - sine * second;
    a[i][q] = sine * first + cosine * second;
  }
}

// Sweeps over all pairs of n columns until none is turned; turned(p, q): turns a pair, or says that there was no need.
template <class Turned>
void sweep(size_t n, Turned&& turned) {
  bool any = true;
  for (int round = 0; any && round < SWEEPS; round++) {
    any = false;
    for (size_t p = 0; p < n; p++)
      for (size_t q = p + 1; q < n; q++) any |= turned(p, q);
  }
}

// The columns of vectors and their values in the order of the values.
nb::tuple ordered(const std::vector<double>& values, const Matrix<double>& vectors, bool descending) {
  std::vector<size_t> order(values.size());
  std::iota(order.begin(), order.end(), size_t(0));
  std::stable_sort(order.begin(), order.end(), [&](size_t a, size_t b) {
    return descending ? values[a] > values[b] : values[a] < values[b];
  });
  std::vector<double> sorted;
  Matrix<double> out(vectors.rows, vectors.columns);
  for (size_t j = 0; j < order.size(); j++) {
    sorted.push_back(values[order[j]]);
    for (size_t i = 0; i < vectors.rows; i++) out[i][j] = vectors[i][order[j]];
  }
  return nb::make_tuple(returned(std::move(sorted)), returned(std::move(out)));
}

// Jacobi's method: of a positive definite matrix that is scaled well small eigenvalues are as exact as large ones.
nb::tuple eigh(Given<double> given) {
  Matrix<double> a = copied(given);
  const size_t n = a.rows;
  double largest = 0.0;
  for (size_t i = 0; i < n; i++) {
    for (size_t j = 0; j <= i; j++) {
      a[i][j] = a[j][i] = 0.5 * (given.data()[i * n + j] + given.data()[j * n + i]);
      largest = std::max(largest, std::fabs(a[i][j]));
    }
  }
  Matrix<double> vectors = Matrix<double>::identity(n);
  sweep(n, [&](size_t p, size_t q) {
    const double between = a[p][q];
    const bool large = std::fabs(between) > std::max(EPS * std::sqrt(std::fabs(a[p][p] * a[q][q])), EPS * EPS * largest);
    if (large) {
      const auto [cosine, sine] = rotation(a[p][p], a[q][q], between);
      turn(a, p, q, cosine, sine);
      for (size_t j = 0; j < n; j++) {
        const double first = a[p][j], second = a[q][j];
        a[p][j] = cosine * first - sine * second;
        a[q][j] = sine * first + cosine * second;
      }
      turn(vectors, p, q, cosine, sine);
    }
    a[p][q] = a[q][p] = 0.0;
    return large;
  });
  std::vector<double> values;
  for (size_t i = 0; i < n; i++) values.push_back(a[i][i]);
  return ordered(values, vectors, false);
}

// Singular values and right singular vectors: columns are turned until they are orthogonal (Hestenes).
nb::tuple svd(Given<double> given) {
  Matrix<double> a = copied(given);
  const size_t n = a.columns;
  const auto along = [&](size_t p, size_t q) {
    double sum = 0.0;
    for (size_t i = 0; i < a.rows; i++) sum += a[i][p] * a[i][q];
    return sum;
  };
  Matrix<double> vectors = Matrix<double>::identity(n);
  sweep(n, [&](size_t p, size_t q) {
    const double first = along(p, p), second = along(q, q), both = along(p, q);
    if (std::fabs(both) <= EPS * std::max(first, second)) return false;  // a turn by less than rounding
    const auto [cosine, sine] = rotation(first, second, both);
    turn(a, p, q, cosine, sine);
    turn(vectors, p, q, cosine, sine);
    return true;
  });
  std::vector<double> sizes;
  for (size_t j = 0; j < n; j++) sizes.push_back(std::sqrt(along(j, j)));
  return ordered(sizes, vectors, true);
}

typedef Matrix<Complex> Complexes;

// Rows and columns of comparable size by powers of two, which are returned: D^-1 a D.
std::vector<double> balance(Matrix<double>& a) {
  const size_t n = a.rows;
  std::vector<double> scale(n, 1.0);
  bool changed = true;
  for (int round = 0; changed && round < 20; round++) {
    changed = false;
    for (size_t i = 0; i < n; i++) {
      double column = 0.0, row = 0.0;
      for (size_t j = 0; j < n; j++) {
        if (j == i) continue;
        column += std::fabs(a[j][i]);
        row += std::fabs(a[i][j]);
      }
      if (!(column > 0.0 && row > 0.0)) continue;
      int power = 0;
      std::frexp(std::sqrt(row / column), &power);
      const double factor = std::ldexp(1.0, power);
      if (factor * column + row / factor >= 0.95 * (column + row)) continue;
      for (size_t j = 0; j < n; j++) a[j][i] *= factor;
      for (size_t j = 0; j < n; j++) a[i][j] /= factor;
      scale[i] *= factor;
      changed = true;
    }
  }
  return scale;
}

// To a matrix without entries below its first subdiagonal, by Householder's reflections, and the basis with it.
void to_hessenberg(Complexes& h, Complexes& basis) {
  const size_t n = h.rows;
  std::vector<Complex> mirror(n);
  for (size_t k = 0; k + 2 < n; k++) {
    double below = 0.0, whole = 0.0;
    for (size_t i = k + 1; i < n; i++) {
      mirror[i] = h[i][k];
      whole += square(mirror[i]);
      if (i > k + 1) below += square(mirror[i]);
    }
    if (below == 0.0) continue;
    const double first = size(mirror[k + 1]);
    mirror[k + 1] += std::sqrt(whole) * (first > 0.0 ? mirror[k + 1] / first : Complex(1.0));
    double length = 0.0;
    for (size_t i = k + 1; i < n; i++) length += square(mirror[i]);
    length = std::sqrt(length);
    for (size_t i = k + 1; i < n; i++) mirror[i] /= length;
    for (size_t j = 0; j < n; j++) {
      Complex sum = 0.0;
      for (size_t i = k + 1; i < n; i++) sum += times(std::conj(mirror[i]), h[i][j]);
      for (size_t i = k + 1; i < n; i++) h[i][j] -= 2.0 * times(mirror[i], sum);
    }
    for (Complexes* part : {&h, &basis}) {
      for (size_t i = 0; i < n; i++) {
        Complex sum = 0.0;
        for (size_t j = k + 1; j < n; j++) sum += times((*part)[i][j], mirror[j]);
        for (size_t j = k + 1; j < n; j++) (*part)[i][j] -= 2.0 * times(sum, std::conj(mirror[j]));
      }
    }
    for (size_t i = k + 2; i < n; i++) h[i][k] = 0.0;
  }
}

// The root of smaller angle, by real square roots alone.
Complex root(Complex a) {
  const double whole = size(a);
  const double real = std::sqrt(0.5 * (whole + std::fabs(a.real())));
  if (real == 0.0) return 0.0;
  const double imag = 0.5 * std::fabs(a.imag()) / real;
  const double sign = a.imag() < 0.0 ? -1.0 : 1.0;
  return a.real() >= 0.0 ? Complex(real, sign * imag) : Complex(imag, sign * real);
}

// Wilkinson's: the eigenvalue of the last two rows that is nearer to the last entry; each tenth time something else.
Complex shift_of(const Complexes& h, size_t high, int round) {
  const Complex a = h[high - 1][high - 1], b = h[high - 1][high], c = h[high][high - 1], d = h[high][high];
  if (round % 10 == 0) return d + size(c);
  const Complex half = 0.5 * (a - d), r = root(times(half, half) + times(b, c));
  const Complex below = square(half + r) >= square(half - r) ? half + r : half - r;
  return square(below) > 0.0 ? d - over(times(b, c), below) : d;
}

// One QR step with a shift on rows low to high.
void qr_step(Complexes& h, Complexes& basis, size_t low, size_t high, Complex shift) {
  const size_t n = h.rows;
  std::vector<std::pair<Complex, Complex>> turns;
  for (size_t k = low; k <= high; k++) h[k][k] -= shift;
  for (size_t k = low; k < high; k++) {
    const double whole = std::sqrt(square(h[k][k]) + square(h[k + 1][k]));
    const Complex c = whole > 0.0 ? h[k][k] / whole : Complex(1.0), s = whole > 0.0 ? h[k + 1][k] / whole : Complex(0.0);
    for (size_t j = k; j < n; j++) {
      const Complex above = h[k][j], under = h[k + 1][j];
      h[k][j] = times(std::conj(c), above) + times(std::conj(s), under);
      h[k + 1][j] = times(c, under) - times(s, above);
    }
    h[k + 1][k] = 0.0;
    turns.push_back({c, s});
  }
  for (size_t k = low; k < high; k++) {
    const auto [c, s] = turns[k - low];
    for (Complexes* part : {&h, &basis}) {
      const size_t end = part == &h ? k + 2 : n;
      for (size_t i = 0; i < end; i++) {
        const Complex left = (*part)[i][k], right = (*part)[i][k + 1];
        (*part)[i][k] = times(left, c) + times(right, s);
        (*part)[i][k + 1] = times(right, std::conj(c)) - times(left, std::conj(s));
      }
    }
  }
  for (size_t k = low; k <= high; k++) h[k][k] += shift;
}

// To a triangle; false where it does not converge.
bool to_triangle(Complexes& h, Complexes& basis) {
  double largest = 0.0;
  for (const Complex& one : h.values) largest = std::max(largest, size(one));
  size_t high = h.rows ? h.rows - 1 : 0;
  for (int round = 1; high > 0; round++) {
    size_t low = high;
    for (; low > 0; low--) {
      const double beside = size(h[low][low]) + size(h[low - 1][low - 1]);
      if (size(h[low][low - 1]) <= EPS * (beside > 0.0 ? beside : largest)) break;
    }
    if (low > 0) h[low][low - 1] = 0.0;
    if (low == high) {
      high--;
      round = 0;
    } else if (round > ROUNDS) {
      return false;
    } else {
      qr_step(h, basis, low, high, shift_of(h, high, round));
    }
  }
  return true;
}

// Of a real matrix: each the mean of itself and of the conjugate of its nearest partner, itself where it is real.
void pair_up(std::vector<Complex>& values) {
  std::vector<size_t> left(values.size());
  std::iota(left.begin(), left.end(), size_t(0));
  std::stable_sort(left.begin(), left.end(), [&](size_t a, size_t b) {
    return std::fabs(values[a].imag()) > std::fabs(values[b].imag());
  });
  while (!left.empty()) {
    const size_t one = left[0];
    size_t near = 0;
    for (size_t i = 1; i < left.size(); i++)
      if (square(std::conj(values[one]) - values[left[i]]) < square(std::conj(values[one]) - values[left[near]])) near = i;
    const size_t other = left[near];
    const Complex mean = 0.5 * (values[one] + std::conj(values[other]));
    values[one] = mean;
    if (other != one) values[other] = std::conj(mean);
    if (near > 0) left.erase(left.begin() + near);
    left.erase(left.begin());
  }
}

// Eigenvalues and vectors of length one, their largest entry real and positive; None where they do not converge.
nb::object eig(Given<double> given) {
  Matrix<double> a = copied(given);
  const size_t n = a.rows;
  const std::vector<double> scale = balance(a);
  Complexes h(n, n), basis = Complexes::identity(n), triangle = Complexes::identity(n), vectors(n, n);
  std::copy(a.values.begin(), a.values.end(), h.values.begin());
  to_hessenberg(h, basis);
  if (!to_triangle(h, basis)) return nb::none();
  double least = std::numeric_limits<double>::min();
  for (const Complex& one : h.values) least = std::max(least, EPS * size(one));
  std::vector<Complex> values;
  for (size_t k = 0; k < n; k++) values.push_back(h[k][k]);
  pair_up(values);
  for (size_t k = 0; k < n; k++) {
    for (size_t i = k; i-- > 0;) {
      Complex rest = 0.0;
      for (size_t j = i + 1; j <= k; j++) rest += times(h[i][j], triangle[j][k]);
      const Complex gap = values[k] - values[i];
      triangle[i][k] = size(gap) > least ? over(rest, gap) : rest / least;
    }
    size_t largest = 0;
    double length = 0.0;
    for (size_t i = 0; i < n; i++) {
      for (size_t j = 0; j <= k; j++) vectors[i][k] += times(basis[i][j], triangle[j][k]);
      vectors[i][k] *= scale[i];
      length += square(vectors[i][k]);
      if (square(vectors[i][k]) > square(vectors[largest][k])) largest = i;
    }
    const double top = size(vectors[largest][k]);
    const Complex phase = std::conj(vectors[largest][k]) / top;
    for (size_t i = 0; i < n; i++) vectors[i][k] = times(vectors[i][k], phase) / std::sqrt(length);
  }
  return nb::make_tuple(returned(std::move(values)), returned(std::move(vectors)));
}

}  // namespace

NB_MODULE(_linear, m) {
  nb::set_leak_warnings(false);
  m.def("product", product<double>);
  m.def("complex_product", product<Complex>);
  m.def("solve", solve<double>);
  m.def("complex_solve", solve<Complex>);
  m.def("eigh", eigh);
  m.def("svd", svd);
  m.def("eig", eig);
  m.def("largest_of", largest_of);
  m.attr("X86_64") = tarsus::x86_64_level();
}
