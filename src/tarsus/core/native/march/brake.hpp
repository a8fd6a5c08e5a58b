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

// x of A x = right for some rows and columns ``of`` a symmetric matrix whose part there is positive definite, by its Cholesky factors; x has their order.
inline std::vector<double> solve_part(const Square& a, const std::vector<int>& of, std::vector<double> right) {
  const int n = int(of.size());
  Square lower(n);
  for (int r = 0; r < n; r++) {
    for (int c = 0; c <= r; c++) {
      double sum = a.at(of[r], of[c]);
      for (int k = 0; k < c; k++) sum -= lower.at(r, k) * lower.at(c, k);
      lower.at(r, c) = r == c ? std::sqrt(std::max(sum, REDUNDANT * a.at(of[r], of[r]))) : sum / lower.at(c, c);
    }
    for (int k = 0; k < r; k++) right[r] -= lower.at(r, k) * right[k];
    right[r] /= lower.at(r, r);
  }
  for (int r = n - 1; r >= 0; r--) {
    for (int k = r + 1; k < n; k++) right[r] -= lower.at(k, r) * right[k];
    right[r] /= lower.at(r, r);
  }
  return right;
}

// The least energy 1/2 p M p + s p within bounds, for contacts that are ``free`` along the ground; the impulses on others are zero. T [1/kg]: rates
// along the ground that they make where normal motion is free.
//
// It is found by proximal steps from zero, which also settle impulses that make no rates: each minimizes the energy plus SOFT T_ii / 2 times the
// square of the way from the last impulses. The bounds whose multipliers act then are a face; once it stays the same from step to step, the least energy on
// it is known at once.
class LeastEnergy {
  static constexpr int MOST = 100;
  static constexpr double SOFT = 0.01;

  const Square &mobility, &along;
  const std::vector<double>& slip;
  const std::vector<uint8_t>& free;
  Square inverse, by;                            // of the softened M; what the bounds take by the multipliers
  std::vector<std::vector<double>> rows, moves;  // of the bounds that act on free contacts; impulses by their multipliers
  std::vector<double> most, multipliers;
  std::vector<int> face;  // bounds that are kept as equations, in the order in which they were taken in
  double none = 0.0;      // [m/s] a rate that is none

  // By how much they break a bound, beyond the rounding of its parts; at most 0 where they keep it.
  double broken(size_t r, const std::vector<double>& impulse) const {
    double sum = -most[r], parts = std::fabs(most[r]);
    for (size_t i = 0; i < impulse.size(); i++) {
      sum += rows[r][i] * impulse[i];
      parts += std::fabs(rows[r][i] * impulse[i]);
    }
    return sum > REDUNDANT * parts ? sum : 0.0;
  }

  // By how much the impulses exceed bound r.
  double excess(int r, const std::vector<double>& impulse) const { return dot(rows[r], impulse) - most[r]; }

  // Keep one bound more than those of the face: its multiplier grows, and bounds whose multipliers vanish leave the
  // face. False where they leave it no room.
  bool keep(int r, std::vector<double>& impulse) {
    while (true) {
      std::vector<double> column;
      for (int c : face) column.push_back(by.at(c, r));
      const std::vector<double> less = solve_part(by, face, column);
      const double room = by.at(r, r) - dot(less, column);
      const double all = room > NO_PART * by.at(r, r) ? excess(r, impulse) / room : INFINITY;
      double share = all;
      int leaves = -1;
      for (size_t k = 0; k < face.size(); k++) {
        if (!(less[k] > 0.0) || multipliers[face[k]] / less[k] >= share) continue;
        share = multipliers[face[k]] / less[k];
        leaves = int(k);
      }
      if (share == INFINITY) return false;
      for (size_t i = 0; i < impulse.size() && all < INFINITY; i++) {
        impulse[i] -= share * moves[r][i];
        for (size_t k = 0; k < face.size(); k++) impulse[i] += share * less[k] * moves[face[k]][i];
      }
      multipliers[r] += share;
      for (size_t k = 0; k < face.size(); k++) multipliers[face[k]] -= share * less[k];
      if (leaves < 0) {
        face.push_back(r);
        return true;
      }
      multipliers[face[leaves]] = 0.0;
      face.erase(face.begin() + leaves);
    }
  }

  // From the least energy without bounds to that on the face, where its bounds press and all others are kept. Else nothing is changed.
  bool stays_on_face(std::vector<double>& impulse) {
    std::vector<double> right;
    for (int c : face) right.push_back(excess(c, impulse));
    const std::vector<double> found = solve_part(by, face, right);
    if (std::any_of(found.begin(), found.end(), [](double one) { return one < 0.0; })) return false;
    std::vector<double> out = impulse;
    for (size_t k = 0; k < face.size(); k++) {
      for (size_t i = 0; i < out.size(); i++) out[i] -= found[k] * moves[face[k]][i];
    }
    for (int r = 0; r < by.size; r++) {
      if (std::find(face.begin(), face.end(), r) == face.end() && broken(r, out) > 0.0) return false;
    }
    impulse = std::move(out);
    return true;
  }

  // On the face of the step before, or by the dual method of Goldfarb and Idnani: from the least energy without bounds, it keeps the one that is broken most,
  // until none is.
  std::vector<double> step(const std::vector<double>& impulse) {
    std::vector<double> rate = slip;
    for (int i = 0; i < mobility.size; i++) rate[i] -= SOFT * along.at(i, i) * impulse[i];
    std::vector<double> next = inverse.times(rate);
    for (double& one : next) one = -one;
    if (stays_on_face(next)) return next;
    std::vector<uint8_t> out_of_play(by.size, 0);  // on the face; or given up: others leave no room to keep it, it is broken by their rounding
    face.clear();
    multipliers.assign(by.size, 0.0);
    for (int round = 0; round < MOST * by.size; round++) {
      for (int r = 0; r < by.size; r++) out_of_play[r] = out_of_play[r] == 2 ? 2 : 0;
      for (int r : face) out_of_play[r] = 1;
      int worst = -1;
      double breach = 0.0;
      for (int r = 0; r < by.size; r++) {
        const double one = out_of_play[r] ? 0.0 : broken(r, next) / std::sqrt(by.at(r, r));
        if (one > breach) {
          breach = one;
          worst = r;
        }
      }
      if (worst < 0) break;
      if (!keep(worst, next)) out_of_play[worst] = 2;
    }
    return next;
  }

  // What of a way leads along the face.
  Square along_face() const {
    const int n = mobility.size, k = int(face.size());
    Square between(k), out(n);
    for (int i = 0; i < n; i++) out.at(i, i) = free[i];
    std::vector<int> all;
    for (int r = 0; r < k; r++) {
      all.push_back(r);
      for (int c = 0; c < k; c++) {
        for (int i = 0; i < n; i++) between.at(r, c) += free[i] ? rows[face[r]][i] * rows[face[c]][i] : 0.0;
      }
    }
    for (int j = 0; j < n; j++) {
      if (!free[j]) continue;
      std::vector<double> right;
      for (int c : face) right.push_back(rows[c][j]);
      const std::vector<double> back = solve_part(between, all, right);
      for (int i = 0; i < n; i++) {
        for (int r = 0; r < k && free[i]; r++) out.at(i, j) -= rows[face[r]][i] * back[r];
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
    constexpr double NO_RATE = 1e-13;  // of the rates along the ground, that the last step still makes
    none = NO_RATE * largest(slip);
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
    std::vector<double> impulse(mobility.size, 0.0);
    std::vector<int> before;
    bool polished = false;  // on this face
    for (int round = 0; round < MOST; round++) {
      std::vector<double> next = step(impulse);
      double change = 0.0;
      for (int i = 0; i < mobility.size; i++) change = std::max(change, SOFT * along.at(i, i) * std::fabs(next[i] - impulse[i]));
      const bool same = face == before;
      if (same && !polished) next = least_of_face(next);
      polished = same;
      before = face;
      impulse = std::move(next);
      if (change <= none) break;
    }
    return impulse;
  }
};

}  // namespace tarsus
