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

// The bound of friction [N] on a sliding foot at the nodes, and its slope by the slip speed [N s/m]; speed [m/s]: in the sense of
// the slip. Where it is negative, beyond a stop, the bound stays what it is at rest: friction that falls with the speed would
// else push a foot backwards from its unstable rest.
inline void sliding_bound(const Legged& s, int i, const LegRows& r, const Row& speed, Row& bound, Row& slope) {
  const auto found = s.laws.friction_by_speed(s.body.legs[i].foot, r.margin, r.strength, larger(speed, Row(0.0)));
  bound = found.value;
  slope = each(found.slope[0], speed, [](double by, double at) { return at > 0.0 && std::isfinite(by) ? by : 0.0; });
}

// Solve w = ``alone`` - force matrix sense bound(sense w) at the nodes, by rows of what a force at one node does to w, from the
// speeds of the rows; the bound there becomes that of the rows. False where it does not settle, or where friction falls so fast
// with the speed that the step is too long to follow the foot.
TARSUS_APART inline bool slide(const Legged& s, const LegStep& table, int i, double h, const Row& alone, LegRows& r) {
  const Leg& leg = s.body.legs[i];
  const double sense = s.feet[i].sense, tolerance = SETTLED * s.settings.gap / h;
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
