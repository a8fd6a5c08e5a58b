// Derivatives of the steps of a legged robot: its equations at the nodes, linearised about the run's own solution.
//
// A *lane* is a copy of the run's robot whose state, loads and rows are derivatives by one number at fixed times. With E what a
// leg makes of the motion V of its hip (momentum less what smooth forces put into it), the body's rates at the nodes solve
//
//   (M + sum R E R) dV = M dV(0) + what the legs make of everything else,
//
// one system of equations a step, for all lanes.
#pragma once
#include "legged/march.hpp"
#include "derive/tangent.hpp"

namespace tarsus::legged {

// The laws of one foot linearised at the nodes of a step: slopes of momentum and smooth force by the gap, of the force by
// the rate, of friction by its arguments; and columns of the inverse of what makes momentum and force consistent, and of what
// makes friction so that depends on the speed.
struct LinearFoot {
  Row by_gap[2], by_rate, by[FRICTION_ARGUMENTS];
  Row inverse[2][2][N], bound_inverse[N];
  bool acts[2], slides, speeds;  // whether a momentum and a smooth force act in the air; sliding with friction; with such by speed
};

// What laws add to the rows of a lane by numbers of their own: momentum and smooth force in the air; held, strength less
// smooth force, strength, and friction.
struct OwnPart {
  Row air[2], smooth, strength, bound;
};

struct LegTangents {
  std::vector<LinearFoot> feet;   // of every leg
  std::vector<OwnPart> own;       // (legs, lanes)
  std::vector<Row> misfit;        // (lanes, coordinates): what numbers of the structure do to the body's momentum
  std::vector<Row> right;         // (coordinates, nodes): misfits of the lanes
  Factored solver;
};

// Make momentum P and smooth force F of a foot consistent with the motion that they lead to: (1 - S G) [P, F] = right side.
inline bool invert_foot(const LegStep& table, double mass, LinearFoot& f) {
  const double(*reach[2])[N][N] = {table.film, table.force};
  std::vector<int> parts;
  for (int a = 0; a < 2; a++) {
    if (f.acts[a]) parts.push_back(a);
    for (int b = 0; b < 2; b++) std::fill_n(f.inverse[a][b], N, Row(0.0));
  }
  const int size = int(parts.size()) * N;
  std::vector<double> matrix(size_t(size) * size);
  for (int r = 0; r < size; r++) {
    const int a = parts[r / N], j = r % N;
    for (int c = 0; c < size; c++) {
      const int b = parts[c / N], l = c % N;
      double value = (r == c) - f.by_gap[a][j] * reach[b][0][l][j];
      if (a == 1) value -= f.by_rate[j] * (reach[b][1][l][j] + (b == 0 && j == l ? 1.0 / mass : 0.0));
      matrix[size_t(r) * size + c] = value;
    }
  }
  Factored solver;
  if (!solver.factor(std::move(matrix), size)) return false;
  for (size_t b = 0; b < parts.size(); b++) {
    std::vector<Row> columns(size, Row(0.0));
    for (int l = 0; l < N; l++) columns[b * N + l].set(l, 1.0);
    solver.solve(columns.data());
    for (int r = 0; r < size; r++) {
      for (int l = 0; l < N; l++) f.inverse[parts[r / N]][parts[b]][l].set(r % N, columns[r][l]);
    }
  }
  return true;
}

// Make the friction of a sliding foot consistent with the speed that it leads to: (1 + S G) bound = right side.
inline bool invert_friction(const LegStep& table, LinearFoot& f) {
  std::vector<double> matrix(N * N);
  for (int j = 0; j < N; j++) {
    for (int l = 0; l < N; l++) matrix[j * N + l] = (j == l) + f.by[SLIP_SPEED][j] * table.force[1][l][j];
  }
  Factored solver;
  if (!solver.factor(matrix, N)) return false;
  Row columns[N];
  for (int l = 0; l < N; l++) {
    columns[l] = Row(0.0);
    columns[l].set(l, 1.0);
  }
  solver.solve(columns);  // by rows
  for (int l = 0; l < N; l++) {
    for (int j = 0; j < N; j++) f.bound_inverse[l].set(j, columns[j][l]);
  }
  return true;
}

// A foot along the ground from u0, w0 under the force q and, where it slides, a friction of which ``own`` does not depend on its
// speed.
inline void slide_linear(const LinearFoot& f, const LegStep& table, double sense, double u0, double w0, const Row& own, LegRows& r) {
  r.bound[ALONG] = f.slides ? own : Row(0.0);
  if (f.speeds) {
    free_motion(table, u0, w0, r.q[ALONG], r.u[ALONG], r.w[ALONG]);
    r.bound[ALONG] = combine(reinterpret_cast<const double*>(f.bound_inverse), own + f.by[SLIP_SPEED] * r.w[ALONG] * sense);
  }
  r.q[ALONG] -= r.bound[ALONG] * sense;
  free_motion(table, u0, w0, r.q[ALONG], r.u[ALONG], r.w[ALONG]);
}

// A foot in the air from u0, w0 under the force q, what its laws do following from ``own`` and its motion.
inline void fly_linear(const LinearFoot& f, const LegStep& table, double mass, double u0, double w0, const Row& q,
                       const Row* own, LegRows& r) {
  free_motion(table, u0, w0, q, r.u[UP], r.w[UP]);
  r.film = r.smooth = Row(0.0);
  if (f.acts[0] || f.acts[1]) {
    const Row film = f.by_gap[0] * r.u[UP] + own[0];
    const Row force = f.by_gap[1] * r.u[UP] + f.by_rate * r.w[UP] + own[1];
    const auto part = [&](int a) {
      return combine(reinterpret_cast<const double*>(f.inverse[a][0]), film) +
             combine(reinterpret_cast<const double*>(f.inverse[a][1]), force);
    };
    r.film = part(0);
    r.smooth = part(1);
    r.u[UP] += combine(&table.film[0][0][0], r.film) + combine(&table.force[0][0][0], r.smooth);
    r.w[UP] += combine(&table.film[1][0][0], r.film) + combine(&table.force[1][0][0], r.smooth);
  }
  r.rate = r.w[UP] + r.film * (1.0 / mass);
}

// Add to the matrix of the body's rates what legs and held feet make of them.
inline bool body_matrix(const Legged& s, int k, double h, const LegTangents& of, Factored& solver) {
  const int nb = s.coordinates(), size = nb * N;
  std::vector<double> matrix(size_t(size) * size, 0.0);
  const double* once = &s.nodes.once[0][0];
  const auto add = [&](const Hip& to, const Hip& from, int l, const Row& made) {
    for (int n = 0; n < to.count; n++) {
      for (int c = 0; c < from.count; c++) {
        const double by = to.by[n] * from.by[c];
        for (int j = 0; j < N; j++) matrix[size_t(to.at[n] * N + j) * size + from.at[c] * N + l] += by * made[j];
      }
    }
  };
  for (int l = 0; l < N; l++) {
    const Row place = load(s.nodes.once[l]) * h;
    Row unit = Row(0.0);
    unit.set(l, 1.0);
    for (int b = 0; b < nb; b++) {
      matrix[size_t(b * N + l) * size + b * N + l] += s.body.mass[b];
      for (int c = 0; c < nb; c++) {
        const Row made = combine(once, place) * (h * s.coupling.stiffness[b][c]) + place * s.coupling.damping[b][c];
        for (int j = 0; j < N; j++) matrix[size_t(b * N + j) * size + c * N + l] += made[j];
      }
    }
    for (int i = 0; i < s.legs(); i++) {
      const Leg& leg = s.body.legs[i];
      const LegStep &up = s.tables.of(k, leg.kind[UP]), &along = s.tables.of(k, leg.kind[ALONG]);
      const Row none[2] = {Row(0.0), Row(0.0)};
      LegRows r;
      if (s.feet[i].contact == AIR) {
        fly_linear(of.feet[i], up, leg.mass, 0.0, 0.0, place * leg.stiffness[UP] + unit * leg.damping[UP], none, r);
        add(leg.hip[UP], leg.hip[UP], l, r.w[UP] * leg.mass - combine(once, r.smooth) * h);
      } else if (of.feet[i].slides) {
        const Row pull = place * leg.stiffness[UP] + unit * leg.damping[UP];
        r.q[ALONG] = Row(0.0);
        slide_linear(of.feet[i], along, s.feet[i].sense[ALONG], 0.0, 0.0, -of.feet[i].by[MARGIN] * pull, r);
        add(leg.hip[ALONG], leg.hip[UP], l, r.w[ALONG] * leg.mass - combine(once, r.q[ALONG]) * h);
      }
      if (s.feet[i].held(ALONG)) continue;
      r.q[ALONG] = place * leg.stiffness[ALONG] + unit * leg.damping[ALONG];
      slide_linear(of.feet[i], along, s.feet[i].sense[ALONG], 0.0, 0.0, Row(0.0), r);
      Row made = r.w[ALONG] * leg.mass;
      if (of.feet[i].speeds) made += combine(once, r.bound[ALONG]) * (h * s.feet[i].sense[ALONG]);
      add(leg.hip[ALONG], leg.hip[ALONG], l, made);
    }
  }
  return solver.factor(std::move(matrix), size);
}

// The legs of a lane for the motion of its body, and what they do to that.
inline void move_lane(const Legged& s, Legged& t, int k, double h, const LegTangents& of, int lane) {
  clear_body(t);
  for (int i = 0; i < t.legs(); i++) {
    const Leg& leg = t.body.legs[i];
    const LeggedFoot& foot = t.feet[i];
    const LinearFoot& f = of.feet[i];
    const OwnPart& own = of.own[size_t(i) * LANES + lane];
    LegRows& r = t.rows[i];
    if (foot.contact == AIR) {
      const Row hip = spring(t, leg, UP);
      fly_linear(f, s.tables.of(k, leg.kind[UP]), leg.mass, foot.u[UP], foot.w[UP], r.load[UP] + hip, own.air, r);
      r.gap = r.u[UP] + leg.gap;
      const Row load = r.load[UP] + r.smooth;
      r.q[UP] = load + hip;
      carry_free(t, i, UP, load, h, r);
    } else {
      r.smooth = own.smooth;
      find_margin(t, i);
    }
    if (foot.contact == STUCK) continue;
    r.q[ALONG] = r.load[ALONG] + spring(t, leg, ALONG);
    slide_linear(f, s.tables.of(k, leg.kind[ALONG]), foot.sense[ALONG], foot.u[ALONG], foot.w[ALONG],
                 f.by[MARGIN] * r.margin + f.by[HELD_STRENGTH] * own.strength + own.bound, r);
    carry_free(t, i, ALONG, r.load[ALONG] - r.bound[ALONG] * foot.sense[ALONG], h, r);
  }
}

// The body's momentum [kg m/s] gained in a lane since the start of the step, from what acts on it and its legs.
inline Row momentum_of(const Legged& t, int b, double h) {
  return combine(&t.nodes.once[0][0], t.at.push[b]) * h - t.at.momentum[b] + t.at.drag[b];
}

// The body at the nodes from its momentum.
inline void body_of_momentum(Legged& t, double h) {
  const double* once = &t.nodes.once[0][0];
  for (int b = 0; b < t.coordinates(); b++) {
    const double inverse = 1.0 / t.body.mass[b];
    const Row place = combine(&t.nodes.twice[0][0], t.at.push[b]) * (h * h) + combine(once, t.at.drag[b] + t.at.film[b]) * h;
    t.at.x[b] = (place - t.at.place[b]) * inverse + t.nodes.times() * (h * t.v[b]) + t.x[b];
    t.at.v[b] = momentum_of(t, b, h) * inverse + t.v[b];
  }
}

// Rows of the lanes for a step of class k whose rows the run has. False where the equations are singular.
inline bool solve_lanes(const Legged& s, std::vector<Legged>& lanes, int k, double h, LegTangents& of) {
  const int nb = s.coordinates();
  const double* once = &s.nodes.once[0][0];
  if (!body_matrix(s, k, h, of, of.solver)) return false;
  of.right.assign(size_t(nb) * N, Row(0.0));
  for (size_t lane = 0; lane < lanes.size(); lane++) {
    Legged& t = lanes[lane];
    for (int b = 0; b < nb; b++) {
      t.at.v[b] = Row(t.v[b]);
      t.at.x[b] = s.nodes.times() * (h * t.v[b]) + t.x[b];
    }
    move_lane(s, t, k, h, of, int(lane));
    for (int b = 0; b < nb; b++) {
      Row gained = momentum_of(t, b, h);
      if (!of.misfit.empty()) gained += of.misfit[lane * nb + b];
      for (int j = 0; j < N; j++) of.right[b * N + j].set(int(lane), gained[j]);
    }
  }
  of.solver.solve(of.right.data());
  for (size_t lane = 0; lane < lanes.size(); lane++) {
    Legged& t = lanes[lane];
    for (int b = 0; b < nb; b++) {
      Row step = Row(0.0);
      for (int j = 0; j < N; j++) step.set(j, of.right[b * N + j][int(lane)]);
      t.at.v[b] += step;
      t.at.x[b] += combine(once, step) * h;
    }
    move_lane(s, t, k, h, of, int(lane));
    body_of_momentum(t, h);
  }
  return true;
}

}  // namespace tarsus::legged
