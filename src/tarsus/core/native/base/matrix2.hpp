// 2 x 2 blocks, one a mode or a leg in one direction, and their exact flow.
#pragma once
#include <algorithm>
#include <cmath>

namespace tarsus {

struct Matrix2 {
  double a[2][2];
};

// exp(T t) of a block with two real eigenvalues, s - root and s + root, that are apart: (T - b) e^(a t) / (a - b) and
// the same with a and b exchanged. The one nearer to zero comes from the product of both, det T: where the other is far
// faster, the difference of s and root has lost it, and with it how a strongly overdamped mode creeps.
inline Matrix2 exponential_apart(const Matrix2& block, double t, double s, double root) {
  const auto& b = block.a;
  const double far = s < 0.0 ? s - root : s + root, det = b[0][0] * b[1][1] - b[0][1] * b[1][0], near = det / far;
  const double e_near = std::exp(std::min(near * t, 700.0)), e_far = std::exp(std::min(far * t, 700.0));
  const double apart = near - far, sine = (e_near - e_far) / apart;
  return {{{((b[0][0] - far) * e_near - (b[0][0] - near) * e_far) / apart, sine * b[0][1]},
           {sine * b[1][0], ((near - b[0][0]) * e_near - (far - b[0][0]) * e_far) / apart}}};
}

// exp(T t) in closed form, whether the block oscillates, creeps or is a rigid body: with s half of the trace and
// D = s^2 - det T, it is e^(s t) [c I + t S (T - s I)], c = cosh(sqrt(D) t) and S = sinhc, or cos and sinc for D < 0.
inline Matrix2 exponential_of(const Matrix2& block, double t) {
  const auto& b = block.a;
  const double s = 0.5 * (b[0][0] + b[1][1]), d = b[0][0] - s;
  const double disc = d * d + b[0][1] * b[1][0], size = std::sqrt(std::fabs(disc)), root = size * t;
  if (disc > 0.0 && root > 0.5) return exponential_apart(block, t, s, size);
  const double decay = std::exp(std::min(s * t, 700.0)), sign = disc < 0.0 ? -1.0 : 1.0;
  const double cosine = decay * (disc < 0.0 ? std::cos(root) : std::cosh(root));
  double sine = decay * (1.0 + sign * root * root / 6.0 + root * root * root * root / 120.0);
  if (root >= 1e-3) sine = decay * (disc < 0.0 ? std::sin(root) : std::sinh(root)) / root;
  sine *= t;
  return {{{cosine + sine * d, sine * b[0][1]}, {sine * b[1][0], cosine + sine * (b[1][1] - s)}}};
}

inline Matrix2 times(const Matrix2& x, const Matrix2& y) {
  Matrix2 out;
  for (int c = 0; c < 2; c++) {
    for (int d = 0; d < 2; d++) out.a[c][d] = x.a[c][0] * y.a[0][d] + x.a[c][1] * y.a[1][d];
  }
  return out;
}

}  // namespace tarsus
