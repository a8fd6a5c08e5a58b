// 2 x 2 blocks, one a mode or a leg in one direction, and their exact flow.
#pragma once
#include <algorithm>
#include <cmath>

namespace tarsus {

struct Matrix2 {
  double a[2][2];
};

// exp(T t) in closed form, whether the block oscillates, creeps or is a rigid body: see tarsus.core.blocks.
inline Matrix2 exponential_of(const Matrix2& block, double t) {
  const auto& b = block.a;
  const double s = 0.5 * (b[0][0] + b[1][1]), d = b[0][0] - s;
  const double disc = d * d + b[0][1] * b[1][0], root = std::sqrt(std::fabs(disc)) * t, growth = s * t;
  double cosine, sine;
  if (disc < 0.0) {
    const double decay = std::exp(growth);
    cosine = decay * std::cos(root);
    sine = root < 1e-3 ? decay * (1.0 - root * root / 6.0 + root * root * root * root / 120.0)
                       : decay * std::sin(root) / root;
  } else {  // without overflow for strongly overdamped blocks
    const double plus = std::exp(std::min(growth + root, 700.0)),
                 minus = std::exp(std::min(growth - root, 700.0));
    cosine = 0.5 * (plus + minus);
    sine = root < 1e-3 ? std::exp(growth) * (1.0 + root * root / 6.0 + root * root * root * root / 120.0)
                       : 0.5 * (plus - minus) / root;
  }
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
