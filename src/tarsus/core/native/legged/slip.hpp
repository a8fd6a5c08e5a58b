// Friction that changes with the slip speed: the speeds of one sliding foot at the nodes by Newton's method.
#pragma once
#include "base/dense.hpp"
#include "legged/legged.hpp"
#include "legged/tables.hpp"

namespace tarsus::legged {

constexpr int SLIP_ROUNDS = 12;
// Most powers of e by which friction that falls with the speed may drive a foot from its motion within a step. An implicit step
// of an unstable motion is right as long as its own growth is some e; far longer ones find a motion of the other sign.
constexpr double MOST_GROWTH = 1.0;
constexpr double SAME_SPEED = 1e-6;  // part of the speeds that Newton's last step may change: its square is rounding

// Whether friction brakes a foot by a bound that depends on its slip speed.
inline bool slips_by_speed(const Legged& s, int i) {
  return s.laws.laws.friction_by_speed && s.feet[i].contact == SLIPPING && s.feet[i].sense != 0.0;
}

// Whether the bound of friction beyond a stop, where the speed in the sense of the slip is negative, is that of its mirror image,
// 2 b(0) - b(-v), so that the nodes of a step in which a slip stops see little of it. Under a foot that begins to slide it stays
// what it is at rest: friction that falls with the speed would else push it backwards, the other motion from an unstable rest.
inline bool mirrored(const Legged& s, int i) { return s.feet[i].start != JUST_SLIDING; }

// The bound of friction [N] on a sliding foot at the nodes, and its slope by the slip speed [N s/m]; speed [m/s]: in the sense of
// the slip.
inline void sliding_bound(const Legged& s, int i, const LegRows& r, const Row& speed, Row& bound, Row& slope) {
  const int f = s.body.legs[i].foot;
  const auto found = s.laws.friction_by_speed(f, r.margin, r.strength, magnitude(speed));
  bound = found.value;
  slope = found.slope[0];
  if (!any_less(speed, Row(0.0)) && finite(slope)) return;
  const Row rest = s.laws.friction(f, r.margin, r.strength, Row(0.0));
  const bool mirror = mirrored(s, i);
  for (int j = 0; j < N; j++) {
    if (!std::isfinite(slope[j])) slope.set(j, 0.0);
    if (!(speed[j] < 0.0)) continue;
    bound.set(j, mirror ? 2.0 * rest[j] - bound[j] : rest[j]);
    if (!mirror) slope.set(j, 0.0);
  }
}

// Solve w = ``alone`` - force matrix sense bound(sense w) at the nodes, by rows of what a force at one node does to w, from the
// speeds of the rows; the bound there becomes that of the rows. False where it does not settle, or where friction falls so fast
// with the speed that the step is too long to follow the foot.
TARSUS_APART inline bool slide(const Legged& s, const LegStep& table, int i, double h, const Row& alone, LegRows& r) {
  const Leg& leg = s.body.legs[i];
  const double sense = s.feet[i].sense, tolerance = CONVERGED * s.settings.gap / h;
  Row w = r.w[ALONG], bound, slope, columns[N];
  w.set(0, s.feet[i].w[ALONG]);
  for (int round = 0; round < SLIP_ROUNDS; round++) {
    sliding_bound(s, i, r, w * sense, bound, slope);
    Row step = alone - combine(table.force[1][0], bound) * sense - w;
    for (int j = 0; j < N; j++) {
      columns[j] = load(table.force[1][j]) * slope[j];
      columns[j].set(j, columns[j][j] + 1.0);
    }
    if (!solve_columns(columns, step) || !finite(step)) return false;
    w += step;
    r.bound = bound + slope * step * sense;
    if (highest(magnitude(step)) > std::min(tolerance, SAME_SPEED * highest(magnitude(w)))) continue;
    return (-lowest(slope) - leg.damping[ALONG]) * h <= MOST_GROWTH * leg.mass;
  }
  return false;
}

}  // namespace tarsus::legged
