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
inline bool slips_by_speed(const Legged& s, int i) { return s.laws.laws.friction_by_speed && s.feet[i].slides_with_friction(); }

// The bound of friction on a foot that slides, at speeds [m/s] in the sense of the slip.
inline SlidingBound bound_at(const Legged& s, int i, const Row& margin, const Row& strength, const Row& speed) {
  const int f = s.body.legs[i].foot;
  SlidingBound out = sliding_bound(s.laws, f, margin, strength, speed, s.feet[i].just_slides());
  if (s.laws.patches.empty()) return out;
  out.value = out.value * s.laws.patches[f].friction;
  for (Row& slope : out.slope) slope = slope * s.laws.patches[f].friction;
  return out;
}

// What a step misses of how friction bends with the slip speed, over what it may: see `bend_error`.
inline double bend_of_slip(const Legged& s, int i, double h) {
  const LegRows& r = s.rows[i];
  const auto law = [&](double at, double speed) {
    return bound_at(s, i, Row(s.polynomial_at(r.margin, at)), Row(s.polynomial_at(r.strength, at)), Row(speed)).value[0];
  };
  return bend_error(s.nodes, r.bound, s.any_way(i) ? r.speed : r.w[ALONG] * s.feet[i].sense[ALONG], no_pull(s, i), h, s.settings.end, law);
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
    const SlidingBound bound = bound_at(s, i, r.margin, r.strength, w * sense);
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

// What a friction force B n of a foot that slides any way does to its velocity r n, both turned by small angles and changed by small
// speeds, along n and across it at the nodes (rows) for a change at one node (columns): r_i dn_i + sum_j G_ij d(B n)_j.
struct Turning {
  Row turn_by_turn[N], speed_by_turn[N], turn_by_speed[N], speed_by_speed[N];
  bool by_speed;

  Turning(const LegStep* const* tables, const LegRows& r, const SlidingBound& bound, bool bends) : by_speed(bends) {
    const Row &c = r.way[ALONG], &e = r.way[ACROSS], &slope = bound.slope[SLIP_SPEED];
    for (int j = 0; j < N; j++) {
      const Row along = load(tables[0]->force[1][j]), across = load(tables[1]->force[1][j]);
      const Row by_sine = along * (e[j] * bound.value[j]), by_cosine = across * (c[j] * bound.value[j]);
      turn_by_turn[j] = e * by_sine + c * by_cosine;
      turn_by_turn[j].set(j, turn_by_turn[j][j] + r.speed[j]);
      speed_by_turn[j] = e * by_cosine - c * by_sine;
      if (!by_speed) continue;
      const Row steep_along = along * (c[j] * slope[j]), steep_across = across * (e[j] * slope[j]);
      turn_by_speed[j] = c * steep_across - e * steep_along;
      speed_by_speed[j] = c * steep_along + e * steep_across;
      speed_by_speed[j].set(j, speed_by_speed[j][j] + 1.0);
    }
  }

  // Angles and speeds that make up for misfits of the velocity across n and along it, at the nodes after the first, which is the state.
  // They take their place. False where there are none.
  bool solve(Row& turn, Row& speed) const {
    constexpr int FREE = N - 1, STRIDE = 2 * FREE + 1;
    const int size = by_speed ? 2 * FREE : FREE;
    double matrix[2 * FREE * STRIDE];
    const auto put = [&](const Row* columns, int row, int column) {
      for (int j = 1; j < N; j++) {
        for (int n = 1; n < N; n++) matrix[(row + n - 1) * STRIDE + column + j - 1] = columns[j][n];
      }
    };
    put(turn_by_turn, 0, 0);
    if (by_speed) {
      put(speed_by_turn, FREE, 0);
      put(turn_by_speed, 0, FREE);
      put(speed_by_speed, FREE, FREE);
    }
    for (int n = 1; n < N; n++) {
      matrix[(n - 1) * STRIDE + size] = turn[n];
      if (by_speed) matrix[(FREE + n - 1) * STRIDE + size] = speed[n];
    }
    if (!eliminate(matrix, size, STRIDE)) return false;
    turn = Row(0.0);
    for (int n = 1; n < N; n++) {
      turn.set(n, matrix[(n - 1) * STRIDE + size]);
      if (by_speed) speed.set(n, matrix[(FREE + n - 1) * STRIDE + size]);
    }
    if (!by_speed) speed -= combine(reinterpret_cast<const double*>(speed_by_turn), turn);
    speed.set(0, 0.0);
    return finite(turn) && finite(speed);
  }
};

// Nothing brakes a foot at the nodes: its velocity is the one without friction, whose direction holds none of it, and Newton's method would have
// nothing to find that by where the speed is zero.
inline void go_unbraked(const LeggedFoot& foot, const Row* alone, LegRows& r) {
  const Row speed = each(alone[0], alone[1], [](double a, double b) { return std::hypot(a, b); });
  for (int j = 1; j < N; j++) {
    r.speed.set(j, speed[j]);
    for (int d : {ALONG, ACROSS}) r.way[d].set(j, speed[j] > 0.0 ? alone[d - ALONG][j] / speed[j] : foot.sense[d]);
  }
  r.bound = Row(0.0);
}

// Solve for speed and direction of a foot that slides any way, from those of the rows; alone: its velocity along and across without
// friction. The bound there becomes that of the rows. False as for ``slide``.
inline bool find_way(const Legged& s, const LegStep* const* tables, int i, double h, const Row* alone, LegRows& r) {
  const Leg& leg = s.body.legs[i];
  const double tolerance = CONVERGED * s.settings.gap / h;
  const bool bends = slips_by_speed(s, i);
  const LeggedFoot& foot = s.feet[i];
  r.speed.set(0, foot.w[ALONG] * foot.sense[ALONG] + foot.w[ACROSS] * foot.sense[ACROSS]);
  for (int d : {ALONG, ACROSS}) r.way[d].set(0, foot.sense[d]);
  for (int round = 0; round < SLIP_ROUNDS; round++) {
    const SlidingBound bound = bound_at(s, i, r.margin, r.strength, r.speed);
    if (highest(magnitude(bound.value)) == 0.0) {
      go_unbraked(foot, alone, r);
      return true;
    }
    Row &along = r.way[ALONG], &across = r.way[ACROSS];
    const Row misfit_along = alone[0] - combine(tables[0]->force[1][0], bound.value * along) - r.speed * along;
    const Row misfit_across = alone[1] - combine(tables[1]->force[1][0], bound.value * across) - r.speed * across;
    Row turn = misfit_across * along - misfit_along * across, change = misfit_along * along + misfit_across * across;
    if (!Turning(tables, r, bound, bends).solve(turn, change)) return false;
    const double turned = highest(magnitude(turn)), share = turned > MOST_TURNED ? MOST_TURNED / turned : 1.0;
    r.speed += change * share;
    r.bound = bound.value + bound.slope[SLIP_SPEED] * change * share;
    // by 2 arctan of half of an angle: it keeps the length, and is that angle to its third power
    const Row half = turn * (0.5 * share), sine = each(half, [](double a) { return 2.0 * a / (1.0 + a * a); }), cosine = 1.0 - half * sine;
    const Row before = along;
    along = before * cosine - across * sine;
    across = before * sine + across * cosine;
    if (turned > SAME_TURN || highest(magnitude(change)) > std::min(tolerance, SAME_SPEED * highest(magnitude(r.speed)))) continue;
    return follows_growth(bound.slope[SLIP_SPEED], std::min(leg.damping[ALONG], leg.damping[ACROSS]), h / leg.mass);
  }
  return false;
}

// Of a foot whose speed r passes zero between two nodes, at a distance from zero of its velocity: how far [m] friction would move it
// in the step that turns with the velocity meanwhile, where that of the nodes turns at once.
inline double turned_at_once(const Legged& s, int i, double h) {
  const LegRows& r = s.rows[i];
  for (int j = 1; j < N; j++) {
    if (!(r.speed[j - 1] > 0.0 && r.speed[j] < 0.0)) continue;
    const double along = r.w[ALONG][j] - r.w[ALONG][j - 1], across = r.w[ACROSS][j] - r.w[ACROSS][j - 1];
    const double square = along * along + across * across, moment = std::fabs(r.w[ALONG][j] * r.w[ACROSS][j - 1] - r.w[ACROSS][j] * r.w[ALONG][j - 1]);
    const double time = moment / square * (s.nodes.tau[j] - s.nodes.tau[j - 1]) * h;
    return std::fabs(r.bound[j]) * time / s.body.legs[i].mass * h;
  }
  return 0.0;
}

// Speed of a foot that slides any way at the nodes, in the direction of its slip: negative beyond a stop.
inline Row slip_speed(const LegRows& r) { return r.w[ALONG] * r.way[ALONG] + r.w[ACROSS] * r.way[ACROSS]; }

// The force at the nodes on a foot that slides any way, friction apart.
inline Row driven(const Legged& s, int i, int d) {
  const Leg& leg = s.body.legs[i];
  const LegRows& r = s.rows[i];
  return r.q[d] + r.bound * r.way[d] - r.u[d] * leg.stiffness[d] - r.w[d] * leg.damping[d];
}

// How close to a stop a foot is that slides any way, w = r n: r + f w, which is zero with w if |f| < 1. With f = Q / B of a force Q and
// the friction B it falls by (1 - f^2) B / m a unit of time while these stay, however n turns: close to a stop, faster than the nodes tell.
struct Stopping {
  double share[2] = {0.0, 0.0};

  Stopping(double bound, double along, double across) {
    if (!(std::hypot(along, across) < bound)) return;  // friction would not stop it: the speed itself
    share[0] = along / bound;
    share[1] = across / bound;
  }
  // With the forces at a moment of the step.
  TARSUS_APART Stopping(const Legged& s, int i, double fraction)
      : Stopping(s.polynomial_at(s.rows[i].bound, fraction), s.polynomial_at(driven(s, i, ALONG), fraction), s.polynomial_at(driven(s, i, ACROSS), fraction)) {}

  bool stops() const { return share[0] != 0.0 || share[1] != 0.0; }
  double of(double along, double across) const { return std::hypot(along, across) + share[0] * along + share[1] * across; }

  // At the nodes, from the velocity at the start and the forces.
  TARSUS_APART Row at_nodes(const Legged& s, int i, double h) const {
    const LegRows& r = s.rows[i];
    Row slope = -r.bound;
    for (int d : {ALONG, ACROSS}) {
      const Row drive = driven(s, i, d);
      slope += drive * share[d - ALONG] + (drive - r.bound * share[d - ALONG]) * r.way[d];
    }
    return combine(&s.nodes.once[0][0], slope) * (h / s.body.legs[i].mass) + of(s.feet[i].w[ALONG], s.feet[i].w[ACROSS]);
  }
};

// The scaled time at which a foot that slides any way stops before it has gone as far as the repetition of a step leaves open, m r^2/2
// over what friction can bear beyond what it has to; else negative. The direction of so short a slip is none.
inline double hardly_slides(const Legged& s, int i, double h) {
  const Leg& leg = s.body.legs[i];
  const double *w = &s.feet[i].w[ALONG], square = w[0] * w[0] + w[1] * w[1];
  const double along = driven(s, i, ALONG)[0], across = driven(s, i, ACROSS)[0], force = std::hypot(along, across);
  const double bound = s.laws.friction(leg.foot, s.rows[i].margin[0], s.rows[i].strength[0], 0.0);
  if (!(0.5 * leg.mass * square <= CONVERGED * s.settings.gap * (bound - force))) return -1.0;
  return square > 0.0 ? leg.mass * bound * Stopping(bound, along, across).of(w[0], w[1]) / ((bound - force) * (bound + force) * h) : 0.0;
}

// Whether a step ends close before the stop of a foot that slides any way, where its nodes already have it slide back.
inline bool slides_back(const Legged& s, int i, double h) {
  if (s.feet[i].just_slides() || slip_speed(s.rows[i])[N - 1] >= -s.settings.speed_zero) return false;
  return Stopping(s, i, 1.0).at_nodes(s, i, h)[N - 1] > s.settings.speed_zero && hardly_slides(s, i, h) < 0.0;
}

// By which factor a velocity at a moment of the step has the speed that the forces give, where a foot that slides any
// way will stop and the nodes err by more than the rounding of both.
constexpr double TOLD = 1e-9;
inline double speed_by_forces(const Legged& s, int i, double h, double fraction, double along, double across) {
  const Stopping then(s, i, fraction);
  if (!then.stops()) return 1.0;
  const double part = s.polynomial_at(then.at_nodes(s, i, h), fraction) / then.of(along, across);
  return part > 0.5 && part < 2.0 && std::fabs(part - 1.0) > TOLD ? part : 1.0;
}

// ``find_way``; where the guess of the rows leads nowhere, from the present velocity.
TARSUS_APART inline bool slide_any_way(const Legged& s, const LegStep* const* tables, int i, double h, const Row* alone, LegRows& r) {
  if (find_way(s, tables, i, h, alone, r)) return true;
  hold_way(s.feet[i], r);
  return find_way(s, tables, i, h, alone, r);
}

}  // namespace tarsus::legged
