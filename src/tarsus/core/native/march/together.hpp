// Impulses on contacts that are struck at one moment: Newton's law of restitution for all of them at once.
//
// With W [1/kg] the rates that unit impulses make, u- [m/s] the rates before and r >= 0 those with which the contacts
// part,
//
//   u+ = u- + W P,   u+ - r >= 0,   P >= 0,   P (u+ - r) = 0.
//
// W is symmetric and positive semidefinite, and all contacts are approached, u- < 0, so that rates u+ exist and are unique; the impulses
// are where W has full rank. Else they are the least of those that make these rates. The kinetic energy changes by
// P (u+ + u-) / 2 = sum P (r + u-) / 2: no rebound r <= -u- adds any, whatever the contacts' restitutions.
#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

namespace tarsus {

// A small square matrix.
struct Square {
  int size;
  std::vector<double> entries;

  explicit Square(int n) : size(n), entries(size_t(n) * n, 0.0) {}
  double& at(int r, int c) { return entries[size_t(r) * size + c]; }
  double at(int r, int c) const { return entries[size_t(r) * size + c]; }
  std::vector<double> times(const std::vector<double>& x) const {
    std::vector<double> out(size, 0.0);
    for (int r = 0; r < size; r++) {
      for (int c = 0; c < size; c++) out[r] += at(r, c) * x[c];
    }
    return out;
  }
};

// Part of a contact's mobility below which others that act leave it none: rounding leaves 1e-16 of it (REDUNDANT of tarsus.core.modes).
constexpr double REDUNDANT = 1e-13;

// Turn rows and columns p and q of a symmetric matrix, and columns of the turns so far, so that its entry (p, q) is zero (Jacobi).
inline void turn_away(Square& matrix, Square& turns, int p, int q) {
  const double off = matrix.at(p, q);
  if (off == 0.0) return;
  const double ratio = 0.5 * (matrix.at(q, q) - matrix.at(p, p)) / off;
  const double t = (ratio < 0.0 ? -1.0 : 1.0) / (std::fabs(ratio) + std::hypot(1.0, ratio)), c = 1.0 / std::hypot(1.0, t), s = t * c;
  const auto turn = [&](double& x, double& y) {
    const double was = x;
    x = c * was - s * y;
    y = s * was + c * y;
  };
  for (int k = 0; k < matrix.size; k++) turn(matrix.at(k, p), matrix.at(k, q));
  for (int k = 0; k < matrix.size; k++) turn(matrix.at(p, k), matrix.at(q, k));
  for (int k = 0; k < matrix.size; k++) turn(turns.at(k, p), turns.at(k, q));
}

// Pseudoinverse of the part of W that ``active`` contacts have, zero elsewhere, weighted by their mobilities W_ii > 0; or the inverse of that
// part plus a softness of each contact, a part of its mobility. none: part of the largest mobility that is none;
// weights: other mobilities, on their diagonal.
inline Square pseudoinverse(const Square& w, const std::vector<uint8_t>& active, double softness = 0.0, double none = REDUNDANT,
                            const Square* weights = nullptr) {
  constexpr int MOST_SWEEPS = 30;
  std::vector<int> of;
  for (int i = 0; i < w.size; i++) {
    if (active[i]) of.push_back(i);
  }
  const int n = int(of.size());
  std::vector<double> scale(n);
  for (int i = 0; i < n; i++) scale[i] = 1.0 / std::sqrt((weights ? *weights : w).at(of[i], of[i]));
  Square values(n), turns(n), out(w.size);
  for (int r = 0; r < n; r++) {
    for (int c = 0; c < n; c++) values.at(r, c) = w.at(of[r], of[c]) * scale[r] * scale[c];
    turns.at(r, r) = 1.0;
  }
  for (int sweep = 0; sweep < MOST_SWEEPS; sweep++) {
    double off = 0.0;
    for (int r = 0; r < n; r++) {
      for (int c = 0; c < r; c++) off = std::max(off, std::fabs(values.at(r, c)));
    }
    if (off < 1e-17) break;
    for (int p = 0; p < n; p++) {
      for (int q = p + 1; q < n; q++) turn_away(values, turns, p, q);
    }
  }
  double most = 0.0;
  for (int k = 0; k < n; k++) most = std::max(most, values.at(k, k));
  for (int r = 0; r < n; r++) {
    for (int c = 0; c < n; c++) {
      double sum = 0.0;
      for (int k = 0; k < n; k++) {
        if (softness > 0.0 || values.at(k, k) > none * most) sum += turns.at(r, k) * turns.at(c, k) / (values.at(k, k) + softness);
      }
      out.at(of[r], of[c]) = sum * scale[r] * scale[c];
    }
  }
  return out;
}

// Part of the impulses and rates below which one is zero, well above their rounding and far below what any motion shows.
constexpr double NO_PART = 1e-10;

inline double largest(const std::vector<double>& x) {
  double most = 0.0;
  for (double one : x) most = std::max(most, std::fabs(one));
  return most;
}

// What impulses leave of the gains that are wanted.
inline std::vector<double> lacking(const Square& w, const std::vector<double>& gain, const std::vector<double>& impulse) {
  std::vector<double> out = w.times(impulse);
  for (int i = 0; i < w.size; i++) out[i] = gain[i] - out[i];
  return out;
}

// Whether impulses on the ``active`` contacts alone make the gains that are wanted there, and all press; they then are ``impulse``, the least.
inline bool press_all(const Square& w, const std::vector<double>& gain, const std::vector<uint8_t>& active, std::vector<double>& impulse) {
  std::vector<double> found = pseudoinverse(w, active).times(gain);
  const std::vector<double> lacks = lacking(w, gain, found);
  const double none = NO_PART * largest(found), still = NO_PART * largest(gain);
  for (int i = 0; i < w.size; i++) {
    if (active[i] && !(found[i] >= -none && std::fabs(lacks[i]) <= still)) return false;
  }
  for (double& one : found) one = std::max(one, 0.0);
  impulse = std::move(found);
  return true;
}

// Bring impulses of the ``active`` contacts to those that make their gains. Of one that would pull, it is zero and the contact no more active.
inline void balance(const Square& w, const std::vector<double>& gain, double softness, std::vector<uint8_t>& active, std::vector<double>& impulse) {
  for (int round = 0; round <= w.size; round++) {
    const std::vector<double> wanted = pseudoinverse(w, active, softness).times(gain);
    double share = 1.0;
    for (int i = 0; i < w.size; i++) {
      if (active[i] && wanted[i] < 0.0) share = std::min(share, impulse[i] / (impulse[i] - wanted[i]));
    }
    for (int i = 0; i < w.size; i++) impulse[i] += share * (wanted[i] - impulse[i]);
    if (share == 1.0) return;
    const double none = REDUNDANT * largest(impulse);
    for (int i = 0; i < w.size; i++) {
      if (!active[i] || impulse[i] > none) continue;
      active[i] = 0;
      impulse[i] = 0.0;
    }
  }
}

// Impulses on contacts that are soft, by Lawson and Hanson's method: it takes in the contact that lacks most, until none lacks more than
// ``none`` [m/s], and gives up those that would pull. Returns which contacts press.
inline std::vector<uint8_t> press_soft(const Square& w, const std::vector<double>& gain, double softness, double none, std::vector<double>& impulse) {
  const int n = w.size;
  std::vector<uint8_t> active(n, 0);
  std::fill(impulse.begin(), impulse.end(), 0.0);
  for (int round = 0; round < 3 * n; round++) {
    const std::vector<double> lacks = lacking(w, gain, impulse);
    int next = -1;
    for (int i = 0; i < n; i++) {
      if (!active[i] && lacks[i] > none && (next < 0 || lacks[i] > lacks[next])) next = i;
    }
    if (next < 0) break;
    active[next] = 1;
    balance(w, gain, softness, active, impulse);
  }
  return active;
}

// Impulses P >= 0 with W P >= gain, complementary; gain = r - u- [m/s]. All contacts press in most impacts. Which of them do else is found of soft
// ones, whose impulses are unique also where contacts determine each other; hardly soft ones where gains of such differ by little.
inline std::vector<double> complementary_impulses(const Square& w, const std::vector<double>& gain) {
  constexpr double SOFT = 1e-6, HARD = 1e-12, EXACT = 1e-13;
  std::vector<double> impulse(w.size, 0.0);
  if (press_all(w, gain, std::vector<uint8_t>(w.size, 1), impulse)) return impulse;
  const double most = largest(gain);
  if (press_all(w, gain, press_soft(w, gain, SOFT, EXACT * most, impulse), impulse)) {
    const std::vector<double> lacks = lacking(w, gain, impulse);
    if (*std::max_element(lacks.begin(), lacks.end()) <= NO_PART * most) return impulse;
  }
  press_all(w, gain, press_soft(w, gain, HARD, NO_PART * most, impulse), impulse);
  return impulse;
}

}  // namespace tarsus
