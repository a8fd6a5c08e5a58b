// Friction of one sliding foot at the nodes by Newton's method: where it changes with the slip speed, and of a foot that slides along
// and across the way.
//
// Coulomb's friction on a foot of mass m with the slip velocity s = r n, |n| = 1, under the force Q is against n,
//
//   m s' = Q - B n,   B = bound(N + f_a, f_a, r):   m r' = Q n - B,   m r n' = Q - (Q n) n.
//
// A foot sticks while |Q| <= B, and begins to slide in Q's direction, to which n is held the harder the smaller r: the force B n is
// smooth there, a repetition with s / |s| is not. So speed and direction of the nodes are the unknowns, and both equations hold for
// them however small r is. Towards a stop n turns to Q's direction by a power of the time left (docs/bodies.md); r goes on
// through zero there as the speed of a foot in one direction does, with friction that is the mirror image of itself.
#pragma once
#include "base/dense.hpp"
#include "legged/legged.hpp"
#include "legged/tables.hpp"
#include "march/friction.hpp"

namespace tarsus::legged {

constexpr int SLIP_ROUNDS = 12;
constexpr double SAME_SPEED = 1e-6;  // part of the speeds that Newton's last step may change: its square is rounding

// Whether friction brakes a foot by a bound that depends on its slip speed.
inline bool slips_by_speed(const Legged& s, int i) { return s.laws.laws.friction_by_speed && s.feet[i].rubs(); }

// The bound of friction on a foot that slides, at speeds [m/s] in the sense of the slip.
inline SlidingBound bound_at(const Legged& s, int i, const LegRows& r, const Row& speed) {
  const int f = s.body.legs[i].foot;
  SlidingBound out = sliding_bound(s.laws, f, r.margin, r.strength, speed, s.feet[i].just_slides());
  if (s.laws.patches.empty()) return out;
  out.value = out.value * s.laws.patches[f].friction;
  for (Row& slope : out.slope) slope = slope * s.laws.patches[f].friction;
  return out;
}

// Solve w = ``alone`` - force matrix sense bound(sense w) at the nodes, by rows of what a force at one node does to w, from the
// speeds of the rows; the bound there becomes that of the rows. False where it does not converge, or where friction falls so fast
// with the speed that the step is too long to follow the foot.
TARSUS_APART inline bool slide(const Legged& s, const double* force, int i, double h, const Row& alone, LegRows& r) {
  const Leg& leg = s.body.legs[i];
  const double sense = s.feet[i].sense[ALONG], tolerance = CONVERGED * s.settings.gap / h;
  Row w = r.w[ALONG], columns[N];
  w.set(0, s.feet[i].w[ALONG]);
  for (int round = 0; round < SLIP_ROUNDS; round++) {
    const SlidingBound bound = bound_at(s, i, r, w * sense);
    const Row& slope = bound.slope[SLIP_SPEED];
    Row step = alone - combine(force, bound.value) * sense - w;
    for (int j = 0; j < N; j++) {
      columns[j] = load(force + N * j) * slope[j];
      columns[j].set(j, columns[j][j] + 1.0);
    }
    if (!solve_columns(columns, step) || !finite(step)) return false;
    w += step;
    r.bound = bound.value + slope * step * sense;
    if (highest(magnitude(step)) > std::min(tolerance, SAME_SPEED * highest(magnitude(w)))) continue;
    return follows_growth(slope, leg.damping[ALONG], h / leg.mass);
  }
  return false;
}

constexpr double SAME_TURN = 1e-7;   // [rad] by which Newton's last step may turn a direction: its square is rounding
constexpr double MOST_TURNED = 1.0;  // [rad] in a round: farther than that friction is no straight line of the angle

// Start the repetition from the present velocity, the same at all nodes.
inline void hold_way(const LeggedFoot& foot, LegRows& r) {
  r.speed = Row(std::hypot(foot.w[ALONG], foot.w[ACROSS]));
  for (int d : {ALONG, ACROSS}) r.way[d] = Row(foot.sense[d]);
}

// One round of Newton's method for r n = ``alone`` - force matrices bound(r) n at the nodes after the first, which is the state: the
// change of speeds r and angles of n, into ``by`` (0 at the first node). False where it has none.
inline bool turn_and_change(const Legged& s, const LegStep* const* tables, const LegRows& r, const SlidingBound& bound, const Row* alone, Row* by) {
  constexpr int SIZE = 2 * (N - 1), STRIDE = SIZE + 1;
  double matrix[SIZE * STRIDE];
  const Row& slope = bound.slope[SLIP_SPEED];
  for (int p = 0; p < 2; p++) {
    const Row &way = r.way[ALONG + p], aside = p == 0 ? -r.way[ACROSS] : r.way[ALONG];
    const Row misfit = alone[p] - combine(tables[p]->force[1][0], bound.value * way) - r.speed * way;
    for (int j = 1; j < N; j++) {
      const Row of = load(tables[p]->force[1][j]);
      for (int n = 1; n < N; n++) {
        double* row = matrix + (2 * (n - 1) + p) * STRIDE + 2 * (j - 1);
        row[0] = (of[n] * slope[j] + (n == j)) * way[j];
        row[1] = (of[n] * bound.value[j] + (n == j) * r.speed[j]) * aside[j];
      }
    }
    for (int n = 1; n < N; n++) matrix[(2 * (n - 1) + p) * STRIDE + SIZE] = misfit[n];
  }
  if (!eliminate(matrix, SIZE, STRIDE)) return false;
  by[0] = by[1] = Row(0.0);
  for (int n = 1; n < N; n++) {
    for (int p = 0; p < 2; p++) by[p].set(n, matrix[(2 * (n - 1) + p) * STRIDE + SIZE]);
  }
  return finite(by[0]) && finite(by[1]);
}

// Solve for speed and direction of a foot that slides any way, from those of the rows; alone: its velocity along and across without
// friction. The bound there becomes that of the rows. False as for ``slide``.
inline bool find_way(const Legged& s, const LegStep* const* tables, int i, double h, const Row* alone, LegRows& r) {
  const Leg& leg = s.body.legs[i];
  const double tolerance = CONVERGED * s.settings.gap / h;
  r.speed.set(0, std::hypot(s.feet[i].w[ALONG], s.feet[i].w[ACROSS]));
  for (int d : {ALONG, ACROSS}) r.way[d].set(0, s.feet[i].sense[d]);
  for (int round = 0; round < SLIP_ROUNDS; round++) {
    const SlidingBound bound = bound_at(s, i, r, r.speed);
    Row by[2];
    if (!turn_and_change(s, tables, r, bound, alone, by)) return false;
    const double turned = highest(magnitude(by[1])), share = turned > MOST_TURNED ? MOST_TURNED / turned : 1.0;
    r.speed += by[0] * share;
    r.bound = bound.value + bound.slope[SLIP_SPEED] * by[0] * share;
    for (int n = 1; n < N; n++) {
      const double c = std::cos(by[1][n] * share), e = std::sin(by[1][n] * share), along = r.way[ALONG][n], across = r.way[ACROSS][n];
      const double size = std::hypot(along, across);
      r.way[ALONG].set(n, (along * c - across * e) / size);
      r.way[ACROSS].set(n, (along * e + across * c) / size);
    }
    if (turned > SAME_TURN || highest(magnitude(by[0])) > std::min(tolerance, SAME_SPEED * highest(magnitude(r.speed)))) continue;
    return follows_growth(bound.slope[SLIP_SPEED], std::min(leg.damping[ALONG], leg.damping[ACROSS]), h / leg.mass);
  }
  return false;
}

// The same; where the guess of the rows leads nowhere, from the present velocity.
TARSUS_APART inline bool slide_any_way(const Legged& s, const LegStep* const* tables, int i, double h, const Row* alone, LegRows& r) {
  if (find_way(s, tables, i, h, alone, r)) return true;
  hold_way(s.feet[i], r);
  return find_way(s, tables, i, h, alone, r);
}

}  // namespace tarsus::legged
