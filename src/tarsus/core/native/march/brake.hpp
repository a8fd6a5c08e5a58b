// Friction in an impact on several contacts at once: of all impulses along the ground that Coulomb's law allows, those that leave the least
// kinetic energy. It is `braking` of one foot, for all of them.
//
// The energy 1/2 p M p + s p is convex in the impulses p [N s], with M [1/kg] the rates along the ground that they make and s [m/s] those
// before. What is allowed, A p <= b, is too: a cone of friction bounds p by a normal impulse that is linear in p. So the rates after the impact
// exist and are unique, whatever the order of the contacts. Where p = 0 is allowed, friction makes no energy.
#pragma once
#include "march/together.hpp"

namespace tarsus {

// Rows of bounds A p <= b on impulses along the ground.
struct Bounds {
  std::vector<std::vector<double>> rows;
  std::vector<double> most;

  // Where a row is nothing it bounds none.
  void add(std::vector<double> row, double b) {
    if (largest(row) == 0.0) return;
    rows.push_back(std::move(row));
    most.push_back(b);
  }
};

inline double dot(const std::vector<double>& x, const std::vector<double>& y) {
  double sum = 0.0;
  for (size_t i = 0; i < x.size(); i++) sum += x[i] * y[i];
  return sum;
}

inline Square product(const Square& x, const Square& y) {
  Square out(x.size);
  for (int r = 0; r < x.size; r++) {
    for (int c = 0; c < x.size; c++) {
      for (int k = 0; k < x.size; k++) out.at(r, c) += x.at(r, k) * y.at(k, c);
    }
  }
  return out;
}

// The least energy 1/2 p M p + s p within bounds, for contacts that are ``free`` along the ground; the impulses on others are zero. T [1/kg]: rates
// along the ground that they make where normal motion is free.
//
// It is found by proximal steps from zero, which also settle impulses that make no rates: each minimizes the energy plus SOFT T_ii / 2 times the
// square of the way from the last impulses. The bounds whose multipliers act then are a face, on which the least energy is known at once.
class LeastEnergy {
  static constexpr int MOST = 100;
  static constexpr double SOFT = 0.01;

  const Square &mobility, &along;
  const std::vector<double>& slip;
  const std::vector<uint8_t>& free;
  Square inverse, by;                            // of the softened M; what the bounds take by the multipliers
  std::vector<std::vector<double>> rows, moves;  // of the bounds that act on free contacts; impulses by their multipliers
  std::vector<double> most, multipliers;
  std::vector<uint8_t> face;

  // By how much they break a bound, beyond the rounding of its parts; at most 0 where they keep it.
  double broken(size_t r, const std::vector<double>& impulse) const {
    double sum = -most[r], parts = std::fabs(most[r]);
    for (size_t i = 0; i < impulse.size(); i++) {
      sum += rows[r][i] * impulse[i];
      parts += std::fabs(rows[r][i] * impulse[i]);
    }
    return sum > REDUNDANT * parts ? sum : 0.0;
  }

  // Keep one bound more, beside those of the face: its multiplier grows, and bounds whose multipliers vanish leave the face. False where they leave
  // it no room.
  bool keep(int r, std::vector<double>& impulse) {
    while (true) {
      const Square inverse_by = pseudoinverse(by, face, 0.0, NO_PART);
      std::vector<double> column(by.size, 0.0);
      for (int c = 0; c < by.size; c++) column[c] = face[c] ? by.at(c, r) : 0.0;
      const std::vector<double> less = inverse_by.times(column);
      const double room = by.at(r, r) - dot(less, column);
      const double all = room > NO_PART * by.at(r, r) ? (dot(rows[r], impulse) - most[r]) / room : INFINITY;
      double share = all;
      int leaves = -1;
      for (int c = 0; c < by.size; c++) {
        if (!face[c] || !(less[c] > 0.0) || multipliers[c] / less[c] >= share) continue;
        share = multipliers[c] / less[c];
        leaves = c;
      }
      if (share == INFINITY) return false;
      for (size_t i = 0; i < impulse.size() && all < INFINITY; i++) {
        impulse[i] -= share * moves[r][i];
        for (int c = 0; c < by.size; c++) impulse[i] += share * less[c] * moves[c][i];
      }
      multipliers[r] += share;
      for (int c = 0; c < by.size; c++) multipliers[c] -= share * less[c];
      face[leaves < 0 ? r : leaves] = leaves < 0;
      if (leaves < 0) return true;
      multipliers[leaves] = 0.0;
    }
  }

  // By the dual method of Goldfarb and Idnani: from the least energy without bounds, it keeps the one that is broken most, until none is.
  std::vector<double> step(const std::vector<double>& impulse) {
    const int n = mobility.size;
    std::vector<double> rate = slip;
    for (int i = 0; i < n; i++) rate[i] -= SOFT * along.at(i, i) * impulse[i];
    std::vector<double> next = inverse.times(rate);
    for (double& one : next) one = -one;
    std::vector<uint8_t> given_up(by.size, 0);  // others leave no room to keep it: it is broken by their rounding
    face.assign(by.size, 0);
    multipliers.assign(by.size, 0.0);
    for (int round = 0; round < MOST * by.size; round++) {
      int worst = -1;
      double breach = 0.0;
      for (int r = 0; r < by.size; r++) {
        const double one = face[r] || given_up[r] ? 0.0 : broken(r, next) / std::sqrt(by.at(r, r));
        if (one > breach) {
          breach = one;
          worst = r;
        }
      }
      if (worst < 0) break;
      if (!keep(worst, next)) given_up[worst] = 1;
    }
    return next;
  }

  // What of a way leads along the face.
  Square along_face() const {
    const int n = mobility.size;
    Square between(by.size), out(n);
    for (int r = 0; r < by.size; r++) {
      for (int c = 0; c < by.size; c++) {
        for (int i = 0; i < n; i++) between.at(r, c) += free[i] ? rows[r][i] * rows[c][i] : 0.0;
      }
    }
    const Square back = pseudoinverse(between, face, 0.0, NO_PART);
    for (int i = 0; i < n; i++) {
      for (int j = 0; j < n; j++) {
        if (!free[i] || !free[j]) continue;
        out.at(i, j) = i == j;
        for (int r = 0; r < by.size; r++) {
          for (int c = 0; c < by.size; c++) out.at(i, j) -= rows[r][i] * back.at(r, c) * rows[c][j];
        }
      }
    }
    return out;
  }

  // The least energy of the face, where that keeps all bounds.
  std::vector<double> least_of_face(const std::vector<double>& impulse) const {
    const int n = mobility.size;
    const Square way = along_face(), moved = product(way, product(mobility, way));
    std::vector<uint8_t> moves_any(n);
    for (int i = 0; i < n; i++) moves_any[i] = free[i] && moved.at(i, i) > NO_PART * along.at(i, i);
    const std::vector<double> turn = way.times(pseudoinverse(moved, moves_any, 0.0, NO_PART, &along).times(way.times(rates(impulse))));
    std::vector<double> out = impulse;
    for (int i = 0; i < n; i++) out[i] -= turn[i];
    for (size_t r = 0; r < rows.size(); r++) {
      if (broken(r, out) > 0.0) return impulse;
    }
    return out;
  }

  std::vector<double> rates(const std::vector<double>& impulse) const {
    std::vector<double> out = mobility.times(impulse);
    for (size_t i = 0; i < out.size(); i++) out[i] += slip[i];
    return out;
  }

 public:
  LeastEnergy(const Square& m, const Square& diagonal, const std::vector<double>& s, const std::vector<uint8_t>& which, const Bounds& bounds)
      : mobility(m), along(diagonal), slip(s), free(which), inverse(0), by(0) {
    Square softened = m;
    for (int i = 0; i < m.size; i++) softened.at(i, i) += SOFT * along.at(i, i);
    inverse = pseudoinverse(softened, which);
    for (size_t r = 0; r < bounds.rows.size(); r++) {
      std::vector<double> move = inverse.times(bounds.rows[r]);
      if (!(dot(bounds.rows[r], move) > 0.0)) continue;
      rows.push_back(bounds.rows[r]);
      moves.push_back(std::move(move));
      most.push_back(bounds.most[r]);
    }
    by = Square(int(rows.size()));
    for (int r = 0; r < by.size; r++) {
      for (int c = 0; c <= r; c++) by.at(r, c) = by.at(c, r) = dot(rows[r], moves[c]);
    }
  }

  std::vector<double> impulses() {
    constexpr double NO_RATE = 1e-13;  // of the rates along the ground, that the last step still makes
    std::vector<double> impulse(mobility.size, 0.0);
    for (int round = 0; round < MOST; round++) {
      const std::vector<double> next = step(impulse);
      double change = 0.0;
      for (int i = 0; i < mobility.size; i++) change = std::max(change, SOFT * along.at(i, i) * std::fabs(next[i] - impulse[i]));
      impulse = least_of_face(next);
      if (change <= NO_RATE * largest(slip)) break;
    }
    return impulse;
  }
};

}  // namespace tarsus
