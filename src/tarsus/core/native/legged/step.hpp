// One step of a legged robot: body and legs consistent at its nodes.
//
// Each leg is exact for the motion of its hip, a polynomial of degree 7 through the nodes. The body follows
// from momentum: with S the feet that nothing holds in a direction, w their rates without the film's momentum
// and H the held ones,
//
//   M (b' - b'(0)) = - sum_S R m (w - w(0)) + int [sum_S R load + sum_H R k (u - a) + load_b]
//                    - sum_H R c (a - a(0)),
//
// so that whatever a leg does within a step, however fast, reaches the body exactly. Both are repeated until
// they agree.
#pragma once
#include "legged/projection.hpp"
#include "legged/film.hpp"
#include "legged/slip.hpp"

namespace tarsus::legged {

constexpr int MOST_SWEEPS = 24, ROUNDS = 4;  // sweeps over all legs, and rounds of one leg alone within a sweep
// After the first WILD_SWEEPS, in which the change may still grow, each sweep must change less than CONTRACTING times what the one
// before changed: a slower one would not converge within MOST_SWEEPS.
constexpr int WILD_SWEEPS = MOST_SWEEPS / 4;
constexpr double CONTRACTING = 0.8;
constexpr double NOT_CONVERGED = -1.0,
                 UNDEFINED = -INF;  // errors of steps that did not converge, or whose numbers are not finite
// A first sweep starts from a guess of the body's motion that is some thousand times less exact than the tolerance: legs need be no
// more exact in it.
constexpr double GUESS_TOLERANCE = 1e3;

// Forces of drives and weight on every foot at the nodes of the step.
inline void load_feet(Legged& s) {
  for (int i = 0; i < s.legs(); i++) {
    const Leg& leg = s.body.legs[i];
    in_directions<UP>(s, [&](auto d) {
      Row sum = Row(-leg.weight[d]);
      for (int n = leg.first; n < leg.last; n++) sum += s.channels[s.body.drive[n]] * s.body.gain[s.directions() * n + d];
      s.rows[i].load[d] = sum;
    });
  }
}

// Drives at the nodes of the step, and their forces on the feet.
inline void fill_drives(Legged& s, double h) {
  for (int c = 0; c < s.player.channels(); c++) {
    s.player.fill(c, s.clock.time, h, reinterpret_cast<double*>(&s.channels[c]));
  }
  load_feet(s);
}

// Strength of the contact of a held foot at the nodes: f_a, and f_a less the smooth force.
inline void held_strength(Legged& s, int i, double h) {
  const int f = s.body.legs[i].foot;
  LegRows& r = s.rows[i];
  const Row now = s.nodes.times() * h + s.clock.time;
  r.strength = s.laws.strength(f, now - s.feet[i].since, s.volts(f));
  r.smooth = r.strength;
  if (s.feet[i].force) r.smooth -= s.laws.force(f, Row(0.0), Row(0.0), s.volts(f), now);
}

// Matrix of the values at the nodes of a step of length h from those of the last one: each polynomial is extrapolated by its first
// powers.
inline void extrapolation(const Legged& s, double h, Row* matrix) {
  Row powers[N];
  for (int c = 0; c < N; c++) powers[c] = load(s.nodes.monomial[c]);
  for (int n = 0; n < GUESSED; n++) {
    for (int c = N - 2; c >= n; c--) powers[c] += powers[c + 1] * s.origin;
  }
  const Row time = s.nodes.times() * (h / s.length);
  for (int j = 0; j < N; j++) {
    matrix[j] = Row(powers[GUESSED - 1][j]);
    for (int c = GUESSED - 2; c >= 0; c--) matrix[j] = matrix[j] * time + powers[c][j];
  }
}

// Of the velocity of a foot that slides any way: that of the last step goes on, if it did so then, or the present one.
constexpr double SAME_WAY = 0.1;  // what the two may differ by at the start
template <class On>
void guess_way(const LeggedFoot& foot, bool known, On&& on, LegRows& r) {
  if (!known) return hold_way(foot, r);
  const Row along = on(r.way[ALONG]), across = on(r.way[ACROSS]), size = each(along * along + across * across, [](double a) { return std::sqrt(a); });
  if (!(std::hypot(along[0] - foot.sense[ALONG], across[0] - foot.sense[ACROSS]) < SAME_WAY) || !(lowest(size) > 1.0 - SAME_WAY)) return hold_way(foot, r);
  r.speed = on(r.speed);
  r.way[ALONG] = each(along, size, [](double a, double b) { return a / b; });
  r.way[ACROSS] = each(across, size, [](double a, double b) { return a / b; });
}

// First guess of the motion of the body and of the feet in the air, extrapolated from the last step, and of the forces at the feet.
inline void first_guess(Legged& s, int k, double h) {
  Row matrix[N];
  const bool known = s.length > 0.0;
  if (known) extrapolation(s, h, matrix);
  const auto on = [&](const Row& values) { return combine(reinterpret_cast<const double*>(matrix), values); };
  for (int b = 0, nb = s.coordinates(); b < nb; b++) {
    s.at.v[b] = known ? on(s.at.v[b]) : Row(s.v[b]);
    s.at.x[b] = combine(&s.nodes.once[0][0], s.at.v[b]) * h + s.x[b];
  }
  for (int i : s.body.leg) {
    const Leg& leg = s.body.legs[i];
    const LeggedFoot& foot = s.feet[i];
    LegRows& r = s.rows[i];
    if (foot.contact != AIR) {
      held_strength(s, i, h);
      if (leg.turned) {
        r.w[ALONG] = Row(foot.w[ALONG]);
        r.u[ALONG] = s.nodes.times() * (foot.w[ALONG] * h) + foot.u[ALONG];
      }
      if (s.any_way(i)) {
        guess_way(foot, known && !foot.just_slides(), on, r);
      } else if (slips_by_speed(s, i)) {
        r.w[ALONG] = known && !foot.just_slides() ? on(r.w[ALONG]) : Row(foot.w[ALONG]);
      }
      continue;
    }
    const double gap = s.gap_now(i);
    r.gap = known && foot.start == AS_IT_COMES ? on(r.gap) : Row(gap);
    if (!(lowest(r.gap) > 0.0)) r.gap = Row(gap);
    if (s.profile != nullptr && std::fabs(r.gap[0] - gap) > 0.5 * gap) r.gap = Row(gap);  // above another facet by now
    if (foot.film) {
      r.film = s.film(i, r.gap);
      double reach = s.tables.of(k, leg.kind[UP]).reach_film;
      if (leg.is_tilted()) reach += s.tables.of(k, leg.kind[ALONG]).reach_film;
      r.stiff = is_stiff(s, reach, leg.foot, r.gap);
    }
    if (!foot.force) continue;
    r.rate = Row(foot.w[UP]);
    if (foot.film) r.rate += r.film * (1.0 / leg.mass);
    r.smooth = s.laws.force(leg.foot, r.gap, r.rate, s.volts(leg.foot), s.nodes.times() * h + s.clock.time);
  }
  s.length = h;
  s.origin = 0.0;
}

// Start the sums on the body: loads on itself and forces of held feet; those of free feet are still zero.
inline void clear_body(Legged& s) {
  const int nb = s.coordinates();
  for (int b = 0; b < nb; b++) {
    Row push = Row(s.coupling.offset[b] - s.body.weight[b]), drag = Row(0.0);
    for (int d = 0; d < s.body.drives; d++) {
      const double load = s.body.load[d * nb + b];
      if (load != 0.0) push += s.channels[d] * load;
    }
    for (int c = 0; c < nb; c++) {
      if (s.coupling.stiffness[b][c] == 0.0 && s.coupling.damping[b][c] == 0.0) continue;
      push -= s.at.x[c] * s.coupling.stiffness[b][c];
      drag -= (s.at.x[c] - s.x[c]) * s.coupling.damping[b][c];
    }
    s.at.push[b] = push;
    s.at.drag[b] = drag;
    s.at.momentum[b] = s.at.place[b] = s.at.film[b] = Row(0.0);
  }
}

// u and w of a leg at the nodes under the forces q, without the film.
TARSUS_INLINE void free_motion(const LegStep& table, double u0, double w0, const Row& q, Row& u, Row& w) {
  u = load(table.state[0]) * u0 + load(table.state[1]) * w0 + combine(&table.force[0][0][0], q);
  w = load(table.state[2]) * u0 + load(table.state[3]) * w0 + combine(&table.force[1][0][0], q);
}

// Forces on the body of a foot that nothing holds in direction d; ``own``: its load without spring and damper.
TARSUS_INLINE void carry_free(Legged& s, int i, int d, const Row& own, double h, const LegRows& r) {
  const Leg& leg = s.body.legs[i];
  const LeggedFoot& foot = s.feet[i];
  const Row momentum = (r.w[d] - foot.w[d]) * leg.mass;
  const Row place = (r.u[d] - foot.u[d] - s.nodes.times() * (foot.w[d] * h)) * leg.mass;
  if (d == UP && foot.film) leg.hip[d].carry(leg.is_tilted() ? r.film * leg.normal[d] : r.film, s.at.film);
  if (d == ALONG && leg.is_tilted() && foot.filmed()) leg.hip[d].carry(r.film * leg.normal[d], s.at.film);
  leg.hip[d].carry(own, s.at.push);
  leg.hip[d].carry(momentum, s.at.momentum);
  leg.hip[d].carry(place, s.at.place);
}

// Forces on a leg through spring and damper from the motion of its hip.
TARSUS_INLINE Row spring(const Legged& s, const Leg& leg, int d) {
  const Row own = leg.hip[d].motion(s.at.x) * leg.stiffness[d] + leg.hip[d].motion(s.at.v) * leg.damping[d];
  if (!leg.turned) return own;
  return own + leg.hip[1 - d].motion(s.at.x) * leg.cross_stiffness + leg.hip[1 - d].motion(s.at.v) * leg.cross_damping;
}

// What a sweep leaves open. change: how far feet would move [m] under the present forces; sum: not finite where a number of the
// sweep is not; failed: a stiff film did not converge. A leg is repeated alone while its change is more than ``enough``.
struct Sweep {
  double enough;
  Row change = Row(0.0), sum = Row(0.0);
  bool failed = false;
};

// A foot in the air above a level facet, upward.
TARSUS_INLINE void fly(Legged& s, int i, int k, double h, Sweep& sweep) {
  const Leg& leg = s.body.legs[i];
  const LeggedFoot& foot = s.feet[i];
  LegRows& r = s.rows[i];
  const LegStep& table = s.tables.of(k, leg.kind[UP]);
  const Row hip = spring(s, leg, UP);
  const Row u0 = load(table.state[0]) * foot.u[UP] + load(table.state[1]) * foot.w[UP];
  const Row w0 = load(table.state[2]) * foot.u[UP] + load(table.state[3]) * foot.w[UP];
  const bool stiff = foot.film && r.stiff;
  const bool rated = foot.force && s.laws.has(leg.foot, USES_RATE);
  Row own = r.load[UP], change = Row(0.0), used = Row(0.0);
  const auto find_rate = [&] {
    r.w[UP] = w0 + combine(&table.force[1][0][0], r.q[UP]);
    if (foot.film) r.w[UP] += combine(&table.film[1][0][0], used);
    r.rate = foot.film ? r.w[UP] + r.film * (1.0 / leg.mass) : r.w[UP];
  };
  for (int n = 0; n < ROUNDS; n++) {
    if (foot.force) own = r.load[UP] + r.smooth;
    r.q[UP] = own + hip;
    r.u[UP] = u0 + combine(&table.force[0][0][0], r.q[UP]);
    if (foot.film) {
      if (stiff && !stiff_film(s, &table.film[0][0][0], i, r.u[UP] + leg.gap, r)) sweep.failed = true;
      used = r.film;
      r.u[UP] += combine(&table.film[0][0][0], used);
      r.gap = r.u[UP] + leg.gap;
      r.film = s.film(i, r.gap);
      // a stiff film has converged by Newton's method; its momentum would only magnify the rounding of the gap
      change = stiff ? Row(0.0) : magnitude(r.film - used) * table.reach_film;
    } else {
      r.gap = r.u[UP] + leg.gap;
    }
    if (foot.force) {
      if (rated) find_rate();
      const Row now = s.nodes.times() * h + s.clock.time, before = r.smooth;
      r.smooth = s.laws.force(leg.foot, r.gap, r.rate, s.volts(leg.foot), now);
      change += magnitude(r.smooth - before) * table.reach_force;
    }
    if (!any_less(Row(sweep.enough), change)) break;
  }
  find_rate();
  sweep.change = larger(sweep.change, change);
  sweep.sum += r.gap + own;
  carry_free(s, i, UP, own, h, r);
}

// A held foot's margin N + f_a = f_a - pull - smooth force.
TARSUS_INLINE void find_margin(Legged& s, int i) {
  const Leg& leg = s.body.legs[i];
  LegRows& r = s.rows[i];
  r.margin = r.smooth - (spring(s, leg, UP) - s.feet[i].u[UP] * leg.stiffness[UP] + r.load[UP]);
  if (!leg.turned) return;
  const bool slides = s.feet[i].contact == SLIPPING;
  r.margin += slides ? r.u[ALONG] * leg.cross_stiffness + r.w[ALONG] * leg.cross_damping : Row(s.feet[i].u[ALONG] * leg.cross_stiffness);
}

// A foot in the air above a facet that slopes: films and forces act along its normal, and so on both directions at once.
TARSUS_APART inline void fly_above_slope(Legged& s, int i, int k, double h, Sweep& sweep) {
  const Leg& leg = s.body.legs[i];
  const LeggedFoot& foot = s.feet[i];
  LegRows& r = s.rows[i];
  const LegStep* table[DIRECTIONS];
  Row hip[DIRECTIONS], own[DIRECTIONS], change = Row(0.0), used = Row(0.0);
  double film[N * N] = {};
  for (int d = 0; d < DIRECTIONS; d++) {
    table[d] = &s.tables.of(k, leg.kind[d]);
    hip[d] = spring(s, leg, d);
    own[d] = r.load[d];
    for (int e = 0; foot.film && e < N * N; e++) film[e] += leg.normal[d] * leg.normal[d] * (&table[d]->film[0][0][0])[e];
  }
  const bool stiff = foot.film && r.stiff;
  for (int n = 0; n < ROUNDS; n++) {
    for (int d = 0; d < DIRECTIONS; d++) {
      if (foot.force) own[d] = r.load[d] + r.smooth * leg.normal[d];
      r.q[d] = own[d] + hip[d];
      free_motion(*table[d], foot.u[d], foot.w[d], r.q[d], r.u[d], r.w[d]);
    }
    change = Row(0.0);
    if (foot.film) {
      if (stiff && !stiff_film(s, film, i, leg.clearance(r.u[UP], r.u[ALONG]), r)) sweep.failed = true;
      used = r.film;
      for (int d = 0; d < DIRECTIONS; d++) {
        r.u[d] += combine(&table[d]->film[0][0][0], used) * leg.normal[d];
        r.w[d] += combine(&table[d]->film[1][0][0], used) * leg.normal[d];
      }
    }
    r.gap = leg.clearance(r.u[UP], r.u[ALONG]);
    r.rate = r.w[UP] * leg.normal[UP] + r.w[ALONG] * leg.normal[ALONG];
    if (foot.film) {
      r.film = s.film(i, r.gap);
      r.rate += r.film * (1.0 / leg.mass);
      if (!stiff) change = magnitude(r.film - used) * (table[UP]->reach_film + table[ALONG]->reach_film);
    }
    if (foot.force) {
      const Row before = r.smooth;
      r.smooth = s.laws.force(leg.foot, r.gap, r.rate, s.volts(leg.foot), s.nodes.times() * h + s.clock.time);
      change += magnitude(r.smooth - before) * (table[UP]->reach_force + table[ALONG]->reach_force);
    }
    if (!any_less(Row(sweep.enough), change)) break;
  }
  sweep.change = larger(sweep.change, change);
  for (int d = 0; d < DIRECTIONS; d++) {
    sweep.sum += r.gap + own[d];
    carry_free(s, i, d, own[d], h, r);
  }
}

// A foot that slides on a facet that slopes. Its tables are those of the level: the stiffness and damping that the slope adds act as
// a force at the nodes, q - more k u - more c w, found by the equations that follow for q.
struct OnSlope {
  const Leg& leg;
  Row inverse[N], u0, w0;
  bool found;

  OnSlope(const Leg& of, const LegStep& table, const LeggedFoot& foot) : leg(of) {
    Row columns[N];
    free_motion(table, foot.u[ALONG], foot.w[ALONG], Row(0.0), u0, w0);
    for (int j = 0; j < N; j++) {
      columns[j] = load(table.force[0][j]) * leg.more_stiffness + load(table.force[1][j]) * leg.more_damping;
      columns[j].set(j, columns[j][j] + 1.0);
    }
    found = invert_columns(columns, inverse);
  }
  Row acting(const Row& force) const {
    return combine(reinterpret_cast<const double*>(inverse), force - u0 * leg.more_stiffness - w0 * leg.more_damping);
  }
};

// What the slope couples of its motion along the facet acts on the body along the normal.
inline void carry_across(Legged& s, int i) {
  const Leg& leg = s.body.legs[i];
  const Row across = (leg.hip[ALONG].motion(s.at.x) - s.rows[i].u[ALONG]) * leg.cross_stiffness +
                     (leg.hip[ALONG].motion(s.at.v) - s.rows[i].w[ALONG]) * leg.cross_damping;
  leg.hip[UP].carry(-across, s.at.push);
}

TARSUS_APART inline void slide_on_slope(Legged& s, int i, int k, double h, Sweep& sweep) {
  const Leg& leg = s.body.legs[i];
  const LeggedFoot& foot = s.feet[i];
  LegRows& r = s.rows[i];
  const LegStep& table = s.tables.of(k, leg.kind[ALONG]);
  const OnSlope slope(leg, table, foot);
  if (!slope.found) sweep.failed = true;
  const Row pulled = spring(s, leg, ALONG) - foot.u[UP] * leg.cross_stiffness;
  Row own = r.load[ALONG], change = Row(0.0);
  for (int n = 0; n < ROUNDS; n++) {
    find_margin(s, i);
    const Row before = n > 0 ? r.bound : Row(0.0);
    if (slips_by_speed(s, i)) {
      double force[N][N];
      for (int j = 0; j < N; j++) store(force[j], combine(table.force[1][0], slope.inverse[j]));
      if (!slide(s, force[0], i, h, slope.w0 + combine(table.force[1][0], slope.acting(r.load[ALONG] + pulled)), r)) sweep.failed = true;
    } else {
      r.bound = s.laws.friction(leg.foot, r.margin, r.strength, Row(0.0));
    }
    own = r.load[ALONG] - r.bound * foot.sense[ALONG];
    r.q[ALONG] = slope.acting(own + pulled);
    free_motion(table, foot.u[ALONG], foot.w[ALONG], r.q[ALONG], r.u[ALONG], r.w[ALONG]);
    change = magnitude(r.bound - before) * (table.reach_force * std::fabs(foot.sense[ALONG]));
    if (n > 0 && !any_less(Row(sweep.enough), change)) break;
  }
  sweep.change = larger(sweep.change, change);
  sweep.sum += r.margin + r.u[ALONG];
  carry_free(s, i, ALONG, own, h, r);
  carry_across(s, i);
}

// A foot that slides or is in the air, along the way or across it.
TARSUS_INLINE void move_along(Legged& s, int i, int d, int k, double h, Sweep& sweep) {
  const Leg& leg = s.body.legs[i];
  const LeggedFoot& foot = s.feet[i];
  LegRows& r = s.rows[i];
  const LegStep& table = s.tables.of(k, leg.kind[d]);
  const Row pulled = spring(s, leg, d);
  Row own = r.load[d];
  if (foot.contact == SLIPPING) {
    if (slips_by_speed(s, i)) {
      Row u, w;
      free_motion(table, foot.u[d], foot.w[d], own + pulled, u, w);
      if (!slide(s, table.force[1][0], i, h, w, r)) sweep.failed = true;
    } else {
      r.bound = s.laws.friction(leg.foot, r.margin, r.strength, Row(0.0));
    }
    own -= r.bound * foot.sense[d];
  }
  r.q[d] = own + pulled;
  free_motion(table, foot.u[d], foot.w[d], r.q[d], r.u[d], r.w[d]);
  carry_free(s, i, d, own, h, r);
}

// A foot that slides any way, along and across at once.
inline void move_any_way(Legged& s, int i, int k, double h, Sweep& sweep) {
  const Leg& leg = s.body.legs[i];
  const LeggedFoot& foot = s.feet[i];
  LegRows& r = s.rows[i];
  const LegStep* const tables[] = {&s.tables.of(k, leg.kind[ALONG]), &s.tables.of(k, leg.kind[ACROSS])};
  Row pulled[2], alone[2], u;
  for (int p = 0; p < 2; p++) {
    const int d = ALONG + p;
    pulled[p] = spring(s, leg, d);
    free_motion(*tables[p], foot.u[d], foot.w[d], r.load[d] + pulled[p], u, alone[p]);
  }
  if (!slide_any_way(s, tables, i, h, alone, r)) sweep.failed = true;
  for (int p = 0; p < 2; p++) {
    const int d = ALONG + p;
    const Row own = r.load[d] - r.bound * r.way[d];
    r.q[d] = own + pulled[p];
    free_motion(*tables[p], foot.u[d], foot.w[d], r.q[d], r.u[d], r.w[d]);
    carry_free(s, i, d, own, h, r);
  }
}

// The forces on feet along directions in which they stick, once the body's motion is known. False where a number is undefined.
inline bool find_held(Legged& s) {
  for (int i : s.body.leg) {
    LegRows& r = s.rows[i];
    const Leg& leg = s.body.legs[i];
    if (s.feet[i].contact == AIR) continue;
    find_margin(s, i);
    if (!finite(r.margin)) return false;
    if (s.feet[i].contact != STUCK) continue;
    in_directions<ALONG>(s, [&](auto d) {
      r.force[d] = r.load[d] + spring(s, leg, d) - s.feet[i].u[d] * leg.stiffness[d];
      if (leg.turned) r.force[d] -= Row(s.feet[i].u[UP] * leg.cross_stiffness);
    });
  }
  return true;
}

// All legs that move, for the present motion of the body.
inline void move_legs(Legged& s, int k, double h, Sweep& sweep) {
  for (int i = 0, legs = s.legs(); i < legs; i++) {
    const Contact contact = s.feet[i].contact;
    if (contact == STUCK) continue;
    if (s.body.legs[i].sloping) {
      contact == SLIPPING ? slide_on_slope(s, i, k, h, sweep) : fly_above_slope(s, i, k, h, sweep);
      continue;
    }
    if (contact == SLIPPING) {
      find_margin(s, i);
      sweep.sum += s.rows[i].margin;
      if (s.any_way(i)) {
        move_any_way(s, i, k, h, sweep);
        continue;
      }
    } else {
      fly(s, i, k, h, sweep);
    }
    in_directions<ALONG>(s, [&](auto d) { move_along(s, i, d, k, h, sweep); });
  }
}

// Truncation of a step over its tolerance: of gaps and of the way along, of the body, of the drives. The highest Legendre
// coefficient of a force counts as a constant one would, for its errors add up from step to step; that of a film's momentum,
// which is what the force takes or gives in all, by what the nodes miss of it within the step.
inline double error_of(const Legged& s, int k, double h) {
  const Nodes& nodes = s.nodes;
  double worst = 0.0, sudden = 0.0;
  for (int i = 0, legs = s.legs(); i < legs; i++) {
    const LegRows& r = s.rows[i];
    if (s.any_way(i)) {
      if (slides_back(s, i, h)) return NOT_CONVERGED;
      worst = std::max(worst, turned_at_once(s, i, h));
    }
    in_directions<UP>(s, [&](auto d) {
      if (s.feet[i].held(d)) return;
      const LegStep& table = s.tables.of(k, s.body.legs[i].kind[d]);
      double error = nodes.truncation(r.q[d]) * table.reach_force;
      if (s.film_share(i, d) != 0.0) {
        const double swing = std::fabs(r.gap[N - 1] - r.gap[0]);
        // a stiff film holds the gap: an error of its momentum moves it no more than the film's slope lets it
        const double yields =
            swing > 0.0 ? table.missed_film * std::fabs(r.film[N - 1] - r.film[0]) / swing : 0.0;
        error += nodes.truncation(r.film) * table.missed_film / (1.0 + yields);  // of a slope, as if it were level
      }
      worst = std::max(worst, error);
      if (d == ALONG && slips_by_speed(s, i)) sudden = std::max(sudden, bend_of_slip(s, i, h));
    });
  }
  for (int b = 0, nb = s.coordinates(); b < nb; b++) {
    const double error = nodes.truncation(s.at.push[b]) * 0.5 * h + nodes.truncation(s.at.drag[b]);
    worst = std::max(worst, error * h / s.body.mass[b] * s.body.lever[b]);
  }
  worst = std::max(worst / s.settings.gap, sudden);
  const int followed = s.laws.commanded() ? s.player.channels() : s.body.drives;  // volts as well where they command the strength
  for (int d = 0; d < followed; d++) {
    const double span = s.player.cursor[d].span;
    if (span > 0.0) worst = std::max(worst, nodes.truncation_of_drive(s.channels[d]) / span / s.settings.drive);
  }
  return worst;
}

struct Attempt {
  double error;  // over the tolerance, or NOT_CONVERGED, UNDEFINED
  int sweeps;
};

// Make the nodes of a step of class k.
inline Attempt attempt(Legged& s, int k) {
  const double h = s.tables.lengths[k], tolerance = CONVERGED * s.settings.gap;
  fill_drives(s, h);
  first_guess(s, k, h);
  double before = INF;
  for (int n = 0; n < MOST_SWEEPS; n++) {
    clear_body(s);
    Sweep sweep{n == 0 ? GUESS_TOLERANCE * tolerance : tolerance};
    move_legs(s, k, h, sweep);
    if (sweep.failed) return {NOT_CONVERGED, n};
    const double moved = finite(sweep.sum) ? follow(s, k, h) : NOT_A_NUMBER;
    if (!std::isfinite(moved)) {
      s.length = 0.0;
      return {UNDEFINED, n};
    }
    const double change = std::max(highest(sweep.change), moved);
    if (n > 0 && change <= tolerance) return {find_held(s) ? error_of(s, k, h) : UNDEFINED, n + 1};
    if (n > WILD_SWEEPS && change > CONTRACTING * before) return {NOT_CONVERGED, n};
    before = change;
  }
  return {NOT_CONVERGED, MOST_SWEEPS};
}

}  // namespace tarsus::legged
