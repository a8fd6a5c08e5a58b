// Friction that changes with the slip speed: the speeds of one sliding foot at the nodes by Newton's method.
#pragma once
#include "base/dense.hpp"
#include "legged/legged.hpp"
#include "legged/tables.hpp"
#include "march/friction.hpp"

namespace tarsus::legged {

constexpr int SLIP_ROUNDS = 12;
constexpr double SAME_SPEED = 1e-6;  // part of the speeds that Newton's last step may change: its square is rounding

// Whether friction brakes a foot in direction d by a bound that depends on its slip speed.
inline bool slips_by_speed(const Legged& s, int i, int d = ALONG) {
  return s.laws.laws.friction_by_speed && s.feet[i].contact == SLIPPING && s.feet[i].sense[d] != 0.0;
}

// The bound of friction on a foot that slides in direction d, at speeds [m/s] in the sense of the slip. Along and across are bounded
// each by itself, a box in the body's directions: so each sticks and slides by events of its own. A disk would have no direction of
// slip at a stop.
inline SlidingBound bound_at(const Legged& s, int i, int d, const LegRows& r, const Row& speed) {
  const int f = s.body.legs[i].foot;
  SlidingBound out = sliding_bound(s.laws, f, r.margin, r.strength, speed, s.feet[i].just_slides(d));
  if (s.laws.patches.empty()) return out;
  out.value = out.value * s.laws.patches[f].friction;
  for (Row& slope : out.slope) slope = slope * s.laws.patches[f].friction;
  return out;
}

// Solve w = ``alone`` - force matrix sense bound(sense w) at the nodes, by rows of what a force at one node does to w, from the
// speeds of the rows; the bound there becomes that of the rows. False where it does not converge, or where friction falls so fast
// with the speed that the step is too long to follow the foot.
TARSUS_APART inline bool slide(const Legged& s, const double* force, int i, int d, double h, const Row& alone, LegRows& r) {
  const Leg& leg = s.body.legs[i];
  const double sense = s.feet[i].sense[d], tolerance = CONVERGED * s.settings.gap / h;
  Row w = r.w[d], columns[N];
  w.set(0, s.feet[i].w[d]);
  for (int round = 0; round < SLIP_ROUNDS; round++) {
    const SlidingBound bound = bound_at(s, i, d, r, w * sense);
    const Row& slope = bound.slope[SLIP_SPEED];
    Row step = alone - combine(force, bound.value) * sense - w;
    for (int j = 0; j < N; j++) {
      columns[j] = load(force + N * j) * slope[j];
      columns[j].set(j, columns[j][j] + 1.0);
    }
    if (!solve_columns(columns, step) || !finite(step)) return false;
    w += step;
    r.bound[d] = bound.value + slope * step * sense;
    if (highest(magnitude(step)) > std::min(tolerance, SAME_SPEED * highest(magnitude(w)))) continue;
    return follows_growth(slope, leg.damping[d], h / leg.mass);
  }
  return false;
}

}  // namespace tarsus::legged
