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
#include "legged_film.hpp"

namespace tarsus {

constexpr int SWEEPS = 24;
constexpr double UNSETTLED = -1.0,
                 UNDEFINED = -INF;  // errors of steps that did not settle, or hold no numbers

// Drives at the nodes of the step, and what they and the weight put on every foot.
inline void fill_drives(Legged& s, double h) {
  for (int c = 0; c < s.player.channels(); c++) {
    s.player.fill(c, s.clock.time, h, reinterpret_cast<double*>(&s.channels[c]));
  }
  for (int i = 0; i < s.legs(); i++) {
    const Leg& leg = s.body.legs[i];
    Row up = Row(-leg.weight), along = Row(0.0);
    for (int n = leg.first; n < leg.last; n++) {
      const Row& force = s.channels[s.body.drive[n]];
      up += force * s.body.gain[2 * n];
      along += force * s.body.gain[2 * n + 1];
    }
    s.rows[i].load[UP] = up;
    s.rows[i].load[ALONG] = along;
  }
}

// What the contact of a held foot holds at the nodes: f_a, and f_a less the smooth force.
inline void held_strength(Legged& s, int i, double h) {
  const int f = s.body.legs[i].foot;
  LegRows& r = s.rows[i];
  const Row now = s.nodes.times() * h + s.clock.time;
  r.strength = s.laws.strength(f, now - s.feet[i].since);
  r.smooth = r.strength;
  if (s.feet[i].force) r.smooth -= s.laws.force(f, Row(0.0), Row(0.0), s.volts(f), now);
}

// First motion of the body, which goes on as it went before, and first forces at the feet.
inline void first_guess(Legged& s, double h) {
  const Row time = s.nodes.times() * h;
  for (int b = 0; b < s.coordinates(); b++) {
    Row v = Row(0.0), x = Row(0.0);
    for (int n = AHEAD - 1; n >= 0; n--) {
      v = v * time + s.ahead[b][n];
      x = x * time + s.ahead[b][n] / (n + 1);
    }
    s.at.v[b] = v;
    s.at.x[b] = x * time + s.x[b];
  }
  for (int i : s.body.leg) {
    const Leg& leg = s.body.legs[i];
    const LeggedFoot& foot = s.feet[i];
    LegRows& r = s.rows[i];
    if (foot.contact != AIR) {
      held_strength(s, i, h);
      continue;
    }
    const double gap = foot.u[UP] + leg.gap;
    double rate = foot.w[UP];
    r.gap = Row(gap);
    if (foot.film) {
      const double momentum = s.laws.momentum(leg.foot, gap);
      rate += momentum / leg.mass;
      r.film = Row(momentum);
    }
    if (foot.force)
      r.smooth = s.laws.force(leg.foot, Row(gap), Row(rate), s.volts(leg.foot), Row(s.clock.time));
  }
}

// Columns of (1 + follow + drag int + push int int)^-1.
inline void make_solver(const Nodes& nodes, const Answer& answer, Row* solver) {
  Row left[N];
  for (int r = 0; r < N; r++) {
    left[r] = load(nodes.once[r]) * answer.drag + load(nodes.twice[r]) * answer.push;
    left[r].set(r, left[r][r] + 1.0 + answer.follow);
    solver[r] = Row(0.0);
    solver[r].set(r, 1.0);
  }
  for (int p = 0; p < N; p++) {  // diagonally dominant for the lengths in use: no pivoting
    const double scale = 1.0 / left[p][p];
    left[p] = left[p] * scale;
    solver[p] = solver[p] * scale;
    for (int r = 0; r < N; r++) {
      const double factor = left[r][p];
      if (r == p || factor == 0.0) continue;
      left[r] -= left[p] * factor;
      solver[r] -= solver[p] * factor;
    }
  }
}

// What held feet do to the body, and how it answers its legs in a step of class k: the matrices of one that
// is taken alone in every coordinate, which is enough to make the repetition settle fast.
inline void make_solvers(Legged& s, int k, double h) {
  s.held = {};
  double follow[MOST_COORDINATES] = {};
  for (int i = 0; i < s.legs(); i++) {
    const Leg& leg = s.body.legs[i];
    for (int d = 0; d < DIRECTIONS; d++) {
      const Hip& hip = leg.hip[d];
      if (!s.feet[i].held(d)) {
        // how far a foot follows its hip within the step: not at all in a short one, and wholly in a long one
        const double share = std::min(s.tables.of(k, leg.kind[d]).reach_force * leg.stiffness[d], 1.0);
        for (int n = 0; n < hip.count; n++) follow[hip.at[n]] += hip.by[n] * hip.by[n] * leg.mass * share;
        continue;
      }
      for (int n = 0; n < hip.count; n++) {
        s.held.offset[hip.at[n]] += hip.by[n] * leg.stiffness[d] * s.feet[i].u[d];
        for (int l = 0; l < hip.count; l++) {
          s.held.stiffness[hip.at[n]][hip.at[l]] += hip.by[n] * hip.by[l] * leg.stiffness[d];
          s.held.damping[hip.at[n]][hip.at[l]] += hip.by[n] * hip.by[l] * leg.damping[d];
        }
      }
    }
  }
  for (int b = 0; b < s.coordinates(); b++) {
    const double m = 1.0 / s.body.mass[b];
    const Answer answer = {s.held.stiffness[b][b] * h * h * m, s.held.damping[b][b] * h * m, follow[b] * m};
    if (answer == s.answer[b]) continue;
    s.answer[b] = answer;
    make_solver(s.nodes, answer, s.solver[b]);
  }
}

// Loads on the body itself and what held feet put on it; nothing carried yet.
inline void clear_body(Legged& s) {
  const int nb = s.coordinates();
  for (int b = 0; b < nb; b++) {
    Row push = Row(s.held.offset[b] - s.body.weight[b]), drag = Row(0.0);
    for (int d = 0; d < s.body.drives; d++) {
      const double load = s.body.load[d * nb + b];
      if (load != 0.0) push += s.channels[d] * load;
    }
    for (int c = 0; c < nb; c++) {
      if (s.held.stiffness[b][c] == 0.0 && s.held.damping[b][c] == 0.0) continue;
      push -= s.at.x[c] * s.held.stiffness[b][c];
      drag -= (s.at.x[c] - s.x[c]) * s.held.damping[b][c];
    }
    s.at.push[b] = push;
    s.at.drag[b] = drag;
    s.at.momentum[b] = s.at.place[b] = Row(0.0);
  }
}

// u and w of a leg at the nodes under the forces q, without the film.
TARSUS_INLINE void free_motion(const LegStep& table, double u0, double w0, const Row& q, Row& u, Row& w) {
  u = load(table.state[0]) * u0 + load(table.state[1]) * w0 + combine(&table.force[0][0][0], q);
  w = load(table.state[2]) * u0 + load(table.state[3]) * w0 + combine(&table.force[1][0][0], q);
}

// Gap, rate, film momentum and smooth force of a foot in the air at the nodes. Returns how much the gap has
// not settled by: infinite where a stiff film does not settle, NaN where a number is undefined.
TARSUS_INLINE double air_laws(const Legged& s, int i, const LegStep& table, double h, LegRows& r) {
  const Leg& leg = s.body.legs[i];
  const LeggedFoot& foot = s.feet[i];
  const double settled = 1e-3 * s.settings.gap;
  const Row before = r.gap - leg.gap;
  double change;
  if (foot.film) {
    const bool stiff = is_stiff(s, table, leg.foot, r.gap);
    if (stiff && !stiff_film(s, table, i, r)) return INF;
    const Row alone = r.u[UP];
    r.u[UP] = alone + combine(&table.film[0][0][0], r.film);
    change = highest(magnitude(r.u[UP] - before));
    if (change > settled && !stiff) {  // once more for the leg alone, which is less than a repetition of all
      r.film = s.laws.momentum(leg.foot, r.u[UP] + leg.gap);
      const Row again = alone + combine(&table.film[0][0][0], r.film);
      change = highest(magnitude(again - r.u[UP]));
      r.u[UP] = again;
    }
    r.w[UP] += combine(&table.film[1][0][0], r.film);
    r.gap = r.u[UP] + leg.gap;
    r.film = s.laws.momentum(leg.foot, r.gap);
    r.rate = r.w[UP] + r.film * (1.0 / leg.mass);
  } else {
    change = highest(magnitude(r.u[UP] - before));
    r.gap = r.u[UP] + leg.gap;
    r.rate = r.w[UP];
  }
  if (foot.force) {
    const Row now = s.nodes.times() * h + s.clock.time;
    const Row smooth = s.laws.force(leg.foot, r.gap, r.rate, s.volts(leg.foot), now);
    if (!finite(smooth)) return NOT_A_NUMBER;
    change = std::max(change, highest(magnitude(smooth - r.smooth)) * table.reach_force);
    r.smooth = smooth;
  }
  if (!finite(r.gap)) return NOT_A_NUMBER;
  return change;
}

// What a foot that nothing holds in direction d does to the body; ``own``: its load without spring and
// damper.
TARSUS_INLINE void carry_free(Legged& s, int i, int d, const Row& own, double h, const LegRows& r) {
  const Leg& leg = s.body.legs[i];
  const LeggedFoot& foot = s.feet[i];
  const Row momentum = (r.w[d] - foot.w[d]) * leg.mass;
  Row place = (r.u[d] - foot.u[d] - s.nodes.times() * (foot.w[d] * h)) * leg.mass;
  if (d == UP && foot.film) place -= combine(&s.nodes.once[0][0], r.film) * h;
  leg.hip[d].carry(own, s.at.push);
  leg.hip[d].carry(momentum, s.at.momentum);
  leg.hip[d].carry(place, s.at.place);
}

// Forces on a leg through spring and damper from the motion of its hip.
TARSUS_INLINE Row spring(const Legged& s, const Leg& leg, int d) {
  return leg.hip[d].motion(s.at.x) * leg.stiffness[d] + leg.hip[d].motion(s.at.v) * leg.damping[d];
}

// A foot in the air, upward. Returns as ``air_laws``.
TARSUS_INLINE double fly(Legged& s, int i, int k, double h) {
  const Leg& leg = s.body.legs[i];
  const LeggedFoot& foot = s.feet[i];
  LegRows& r = s.rows[i];
  Row own = r.load[UP];
  if (foot.force) own += r.smooth;
  r.q[UP] = own + spring(s, leg, UP);
  const LegStep& table = s.tables.of(k, leg.kind[UP]);
  free_motion(table, foot.u[UP], foot.w[UP], r.q[UP], r.u[UP], r.w[UP]);
  const double change = leg.foot >= 0 ? air_laws(s, i, table, h, r) : 0.0;
  carry_free(s, i, UP, own, h, r);
  return change;
}

// A held foot's margin N + f_a = f_a - pull - smooth force.
TARSUS_INLINE void find_margin(Legged& s, int i) {
  const Leg& leg = s.body.legs[i];
  LegRows& r = s.rows[i];
  r.margin = r.smooth - (spring(s, leg, UP) - s.feet[i].u[UP] * leg.stiffness[UP] + r.load[UP]);
}

// A foot that slides or is in the air, along the way.
TARSUS_INLINE void move_along(Legged& s, int i, int k, double h) {
  const Leg& leg = s.body.legs[i];
  const LeggedFoot& foot = s.feet[i];
  LegRows& r = s.rows[i];
  Row own = r.load[ALONG];
  if (foot.contact == SLIPPING) {
    r.bound = s.laws.friction(leg.foot, r.margin, r.strength);
    own -= r.bound * foot.sense;
  }
  r.q[ALONG] = own + spring(s, leg, ALONG);
  free_motion(s.tables.of(k, leg.kind[ALONG]), foot.u[ALONG], foot.w[ALONG], r.q[ALONG], r.u[ALONG],
              r.w[ALONG]);
  carry_free(s, i, ALONG, own, h, r);
}

// The forces on feet that stick, once the body's motion is known. False where a number is undefined.
inline bool find_held(Legged& s) {
  for (int i : s.body.leg) {
    LegRows& r = s.rows[i];
    const Leg& leg = s.body.legs[i];
    if (s.feet[i].contact == AIR) continue;
    find_margin(s, i);
    if (!finite(r.margin)) return false;
    if (s.feet[i].contact != STUCK) continue;
    r.along = r.load[ALONG] + spring(s, leg, ALONG) - s.feet[i].u[ALONG] * leg.stiffness[ALONG];
  }
  return true;
}

// All legs that move, for the present motion of the body. Returns as ``air_laws`` the largest of all.
inline double move_legs(Legged& s, int k, double h) {
  double change = 0.0;
  for (int i = 0; i < s.legs(); i++) {
    const Contact contact = s.feet[i].contact;
    if (contact == STUCK) continue;
    if (contact == SLIPPING) {
      find_margin(s, i);
      if (!finite(s.rows[i].margin)) return NOT_A_NUMBER;
    } else {
      const double moved = fly(s, i, k, h);
      if (!std::isfinite(moved)) return moved;
      change = std::max(change, moved);
    }
    move_along(s, i, k, h);
  }
  return change;
}

// The body's motion at the nodes from what the legs did. Returns the largest change of a hip [m].
inline double follow(Legged& s, double h) {
  BodyRows& at = s.at;
  double change = 0.0;
  for (int b = 0; b < s.coordinates(); b++) {
    const double m = 1.0 / s.body.mass[b];
    const Row v =
        combine(&s.nodes.once[0][0], at.push[b]) * (h * m) - at.momentum[b] * m + at.drag[b] * m + s.v[b];
    Row x = combine(&s.nodes.twice[0][0], at.push[b]) * (h * h * m) - at.place[b] * m;
    x += combine(&s.nodes.once[0][0], at.drag[b]) * (h * m) + s.nodes.times() * (h * s.v[b]) + s.x[b];
    const Row misfit = x - at.x[b];
    const Row step = combine(reinterpret_cast<const double*>(s.solver[b]), misfit);
    // the velocity answers the step through the same legs
    const Answer& answer = s.answer[b];
    const Row held = step * (answer.drag / h) + combine(&s.nodes.once[0][0], step) * (answer.push / h);
    at.v[b] = (v - held + at.v[b] * answer.follow) * (1.0 / (1.0 + answer.follow));
    at.x[b] += step;
    if (!finite(step)) return NOT_A_NUMBER;
    change = std::max(change, highest(magnitude(step)) * s.body.lever[b]);
  }
  return change;
}

// Truncation of a step over its tolerance: of gaps and of the way along, of the body, of the drives.
inline double error_of(const Legged& s, int k, double h) {
  const Nodes& nodes = s.nodes;
  double worst = 0.0;
  for (int i = 0; i < s.legs(); i++) {
    const LegRows& r = s.rows[i];
    for (int d = 0; d < DIRECTIONS; d++) {
      if (s.feet[i].held(d)) continue;
      const LegStep& table = s.tables.of(k, s.body.legs[i].kind[d]);
      double error = nodes.truncation(r.q[d]) * table.reach_force;
      if (d == UP && s.feet[i].filmed()) {
        const double swing = std::fabs(r.gap[N - 1] - r.gap[0]);
        // a stiff film holds the gap: an error of its momentum moves it no more than the film's slope lets it
        const double yields =
            swing > 0.0 ? table.reach_film * std::fabs(r.film[N - 1] - r.film[0]) / swing : 0.0;
        error += nodes.truncation(r.film) * table.reach_film / (1.0 + yields);
      }
      worst = std::max(worst, error);
    }
  }
  for (int b = 0; b < s.coordinates(); b++) {
    const double error = nodes.truncation(s.at.push[b]) * 0.5 * h + nodes.truncation(s.at.drag[b]);
    worst = std::max(worst, error * h / s.body.mass[b] * s.body.lever[b]);
  }
  worst /= s.settings.gap;
  for (int d = 0; d < s.body.drives; d++) {
    const double span = s.player.cursor[d].span;
    if (span > 0.0) worst = std::max(worst, nodes.truncation(s.channels[d]) / span / s.settings.drive);
  }
  return worst;
}

struct Attempt {
  double error;  // over the tolerance, or UNSETTLED, UNDEFINED
  int sweeps;
};

// Make the nodes of a step of class k.
inline Attempt attempt(Legged& s, int k) {
  const double h = s.tables.lengths[k], tolerance = 1e-3 * s.settings.gap;
  fill_drives(s, h);
  first_guess(s, h);
  make_solvers(s, k, h);
  double before = INF;
  for (int n = 0; n < SWEEPS; n++) {
    clear_body(s);
    double change = move_legs(s, k, h);
    if (!std::isfinite(change)) return {std::isnan(change) ? UNDEFINED : UNSETTLED, n};
    const double moved = follow(s, h);
    if (!std::isfinite(moved)) return {UNDEFINED, n};
    change = std::max(n > 0 ? change : INF, moved);
    if (change <= tolerance) return {find_held(s) ? error_of(s, k, h) : UNDEFINED, n + 1};
    if (n > 6 && change > 0.8 * before) return {UNSETTLED, n};
    before = change;
  }
  return {UNSETTLED, SWEEPS};
}

}  // namespace tarsus
