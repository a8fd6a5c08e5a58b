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
// the rate, of friction by its arguments; columns of the inverse of what makes momentum and force consistent, and of what makes the force
// along the ground so that depends on the foot's own motion there: of friction by speed, and on a slope. rub: friction by displacement and
// rate along the ground; bend: all that the foot's tables have not, likewise.
struct LinearFoot {
  Row by_gap[2], by_rate, by[FRICTION_ARGUMENTS], rub[2], bend[2];
  Row inverse[2][2][N], bent[N];
  bool acts[2], slides, bends;  // whether a momentum and a smooth force act in the air; sliding with friction; the last above
};

// What a number's own adds to the rows of a lane. By laws: momentum and smooth force in the air; held, strength less smooth force,
// strength, and friction. By what moves the facet below: forces and the film's momentum, that turn with it; lift: gap and its rate in
// the air, displacement upward and its rate of a foot that slides; turned: its pull.
struct OwnPart {
  Row air[2], smooth, strength, bound, push[DIRECTIONS], film[DIRECTIONS], lift[2], turned;
};

struct LegTangents {
  std::vector<LinearFoot> feet;   // of every leg
  std::vector<OwnPart> own;       // (legs, lanes)
  std::vector<Row> misfit;        // (lanes, coordinates): what numbers of the structure do to the body's momentum
  std::vector<Row> right;         // (coordinates, nodes): misfits of the lanes
  Factored solver;
};

// Make momentum P and smooth force F of a foot, which act along the normal of the ground, consistent with the motion that they lead to:
// (1 - S G) [P, F] = right side.
inline bool invert_foot(const LegStep* const* tables, const Leg& leg, LinearFoot& f) {
  const auto reach = [&](int b, int v, int l, int j) {
    double out = 0.0;
    for (int d = 0; d < DIRECTIONS; d++) {
      if (leg.normal[d] != 0.0) out += leg.normal[d] * leg.normal[d] * (b == 0 ? tables[d]->film : tables[d]->force)[v][l][j];
    }
    return out;
  };
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
      double value = (r == c) - f.by_gap[a][j] * reach(b, 0, l, j);
      if (a == 1) value -= f.by_rate[j] * (reach(b, 1, l, j) + (b == 0 && j == l ? 1.0 / leg.mass : 0.0));
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

// Make the force along the ground on a foot that slides consistent with the motion that it leads to: (1 + bend T) q = right side.
inline bool invert_bend(const LegStep& table, LinearFoot& f) {
  std::vector<double> matrix(N * N);
  for (int j = 0; j < N; j++) {
    for (int l = 0; l < N; l++) matrix[j * N + l] = (j == l) + f.bend[0][j] * table.force[0][l][j] + f.bend[1][j] * table.force[1][l][j];
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
    for (int j = 0; j < N; j++) f.bent[l].set(j, columns[j][l]);
  }
  return true;
}

// A foot along the ground from u0, w0 under the force q and, where it slides, a friction of which ``own`` does not depend on its
// own motion.
inline void slide_linear(const LinearFoot& f, const LegStep& table, double sense, double u0, double w0, const Row& own, LegRows& r) {
  r.bound = f.slides ? own : Row(0.0);
  r.q[ALONG] -= r.bound * sense;
  if (f.bends) {
    free_motion(table, u0, w0, Row(0.0), r.u[ALONG], r.w[ALONG]);
    const Row right = r.q[ALONG] - f.bend[0] * r.u[ALONG] - f.bend[1] * r.w[ALONG];
    r.q[ALONG] = combine(reinterpret_cast<const double*>(f.bent), right);
  }
  free_motion(table, u0, w0, r.q[ALONG], r.u[ALONG], r.w[ALONG]);
  if (f.slides && f.bends) r.bound += f.rub[0] * r.u[ALONG] + f.rub[1] * r.w[ALONG];
}

// A foot in the air in one direction from u0, w0 under the force r.q and a momentum that the ground's turning has of the film.
inline void fly_freely(const LegStep& table, int d, double u0, double w0, LegRows& r) {
  free_motion(table, u0, w0, r.q[d], r.u[d], r.w[d]);
  if (!r.leans) return;
  r.u[d] += combine(&table.film[0][0][0], r.leaned[d]);
  r.w[d] += combine(&table.film[1][0][0], r.leaned[d]);
}

// What its laws do follows from ``own`` and this motion, and adds to it.
inline void fly_linear(const LinearFoot& f, const LegStep* const* tables, const Leg& leg, const Row* own, LegRows& r) {
  const auto along_normal = [&](const Row* of) { return leg.leans() ? of[UP] * leg.normal[UP] + of[ALONG] * leg.normal[ALONG] : of[UP]; };
  r.film = r.smooth = Row(0.0);
  if (f.acts[0] || f.acts[1]) {
    const Row gap = along_normal(r.u), film = f.by_gap[0] * gap + own[0];
    const Row force = f.by_gap[1] * gap + f.by_rate * along_normal(r.w) + own[1];
    const auto part = [&](int a) {
      return combine(reinterpret_cast<const double*>(f.inverse[a][0]), film) +
             combine(reinterpret_cast<const double*>(f.inverse[a][1]), force);
    };
    r.film = part(0);
    r.smooth = part(1);
    for (int d = 0; d < DIRECTIONS; d++) {
      const double share = leg.normal[d];
      if (share == 0.0) continue;
      r.u[d] += (combine(&tables[d]->film[0][0][0], r.film) + combine(&tables[d]->force[0][0][0], r.smooth)) * share;
      r.w[d] += (combine(&tables[d]->film[1][0][0], r.film) + combine(&tables[d]->force[1][0][0], r.smooth)) * share;
    }
  }
  r.rate = along_normal(r.w) + r.film * (1.0 / leg.mass);
}

// Add to the matrix of the body's rates what legs and held feet make of them.
class BodyMatrix {
 public:
  BodyMatrix(const Legged& of, int k, double length, const LegTangents& linear)
      : s(of), class_(k), h(length), linear_(linear), once_(&s.nodes.once[0][0]), size_(s.coordinates() * N), matrix_(size_t(size_) * size_, 0.0) {}

  bool factor(Factored& solver) {
    const int nb = s.coordinates();
    for (int l = 0; l < N; l++) {
      unit_ = Row(0.0);
      unit_.set(l, 1.0);
      place_ = load(s.nodes.once[l]) * h;
      for (int b = 0; b < nb; b++) {
        matrix_[size_t(b * N + l) * size_ + b * N + l] += s.body.mass[b];
        for (int c = 0; c < nb; c++) {
          const Row made = combine(once_, place_) * (h * s.coupling.stiffness[b][c]) + place_ * s.coupling.damping[b][c];
          for (int j = 0; j < N; j++) matrix_[size_t(b * N + j) * size_ + c * N + l] += made[j];
        }
      }
      for (int i = 0; i < s.legs(); i++) {
        for (int from = 0; from < DIRECTIONS; from++) {
          if (s.feet[i].contact == AIR) fly(i, from, l);
          if (s.feet[i].contact == SLIPPING) slide(i, from, l);
        }
      }
    }
    return solver.factor(std::move(matrix_), size_);
  }

 private:
  const Legged& s;
  const int class_;
  const double h;
  const LegTangents& linear_;
  const double* once_;
  const int size_;
  std::vector<double> matrix_;
  Row unit_, place_;  // the body's rate and displacement at the nodes, of one node's rate

  void add(const Hip& to, const Hip& from, int l, const Row& made) {
    for (int n = 0; n < to.count; n++) {
      for (int c = 0; c < from.count; c++) {
        const double by = to.by[n] * from.by[c];
        for (int j = 0; j < N; j++) matrix_[size_t(to.at[n] * N + j) * size_ + from.at[c] * N + l] += by * made[j];
      }
    }
  }
  Row pulled(double stiffness, double damping) const { return place_ * stiffness + unit_ * damping; }

  void fly(int i, int from, int l) {
    const Leg& leg = s.body.legs[i];
    const LegStep* const tables[] = {&s.tables.of(class_, leg.kind[UP]), &s.tables.of(class_, leg.kind[ALONG])};
    const Row none[2] = {Row(0.0), Row(0.0)};
    LegRows r;
    r.u[1 - from] = r.w[1 - from] = r.smooth = Row(0.0);
    r.q[from] = pulled(leg.stiffness[from], leg.damping[from]);
    fly_freely(*tables[from], from, 0.0, 0.0, r);
    if (from == UP || leg.leans()) fly_linear(linear_.feet[i], tables, leg, none, r);
    for (int d = 0; d < DIRECTIONS; d++) {
      if (d == from || leg.leans()) add(leg.hip[d], leg.hip[from], l, r.w[d] * leg.mass - combine(once_, r.smooth) * (h * leg.normal[d]));
    }
  }

  void slide(int i, int from, int l) {
    const Leg& leg = s.body.legs[i];
    const LinearFoot& f = linear_.feet[i];
    if (from == UP && !f.slides && !leg.turned) return;
    const Row own = pulled(leg.stiffness[from], leg.damping[from]), cross = pulled(leg.cross_stiffness, leg.cross_damping);
    LegRows r;
    r.q[ALONG] = from == ALONG ? own : cross;
    slide_linear(f, s.tables.of(class_, leg.kind[ALONG]), s.feet[i].sense[ALONG], 0.0, 0.0, -f.by[MARGIN] * (from == UP ? own : cross), r);
    Row made = r.w[ALONG] * leg.mass;
    if (f.slides) made += combine(once_, r.bound) * (h * s.feet[i].sense[ALONG]);
    add(leg.hip[ALONG], leg.hip[from], l, made);
    if (!leg.turned) return;
    const Row across = (from == ALONG ? cross : Row(0.0)) - r.u[ALONG] * leg.cross_stiffness - r.w[ALONG] * leg.cross_damping;
    add(leg.hip[UP], leg.hip[from], l, combine(once_, across) * h);
  }
};

// The legs of a lane for the motion of its body, and what they do to that.
inline void fly_lane(const Legged& s, Legged& t, int i, int k, double h, const LinearFoot& f, const OwnPart& own) {
  const Leg& leg = t.body.legs[i];
  const LeggedFoot& foot = t.feet[i];
  const LegStep* const tables[] = {&s.tables.of(k, leg.kind[UP]), &s.tables.of(k, leg.kind[ALONG])};
  LegRows& r = t.rows[i];
  for (int d = 0; d < DIRECTIONS; d++) {
    r.leaned[d] = own.film[d];
    r.q[d] = r.load[d] + own.push[d] + spring(t, leg, d);
    fly_freely(*tables[d], d, foot.u[d], foot.w[d], r);
  }
  fly_linear(f, tables, leg, own.air, r);
  r.gap = (leg.leans() ? r.u[UP] * leg.normal[UP] + r.u[ALONG] * leg.normal[ALONG] : r.u[UP]) + own.lift[0];
  r.rate += own.lift[1];
  for (int d = 0; d < DIRECTIONS; d++) {
    r.q[d] += r.smooth * leg.normal[d];
    carry_free(t, i, d, r.load[d] + own.push[d] + r.smooth * leg.normal[d], h, r);
    if (r.leans) leg.hip[d].carry(r.leaned[d], t.at.film);
  }
}

inline void slide_lane(const Legged& s, Legged& t, int i, int k, double h, const LinearFoot& f, const OwnPart& own) {
  const Leg& leg = t.body.legs[i];
  const LeggedFoot& foot = t.feet[i];
  LegRows& r = t.rows[i];
  r.smooth = own.smooth;
  r.u[ALONG] = r.w[ALONG] = Row(0.0);  // what friction has of them is found with them
  find_margin(t, i);
  const Row lifted = own.lift[0] * leg.stiffness[UP] + own.lift[1] * leg.damping[UP];
  const Row load = r.load[ALONG] + own.push[ALONG];
  r.q[ALONG] = load + spring(t, leg, ALONG) - (own.lift[0] + foot.u[UP]) * leg.cross_stiffness - own.lift[1] * leg.cross_damping;
  slide_linear(f, s.tables.of(k, leg.kind[ALONG]), foot.sense[ALONG], foot.u[ALONG], foot.w[ALONG],
               f.by[MARGIN] * (r.margin + lifted) + f.by[HELD_STRENGTH] * own.strength + own.bound, r);
  carry_free(t, i, ALONG, load - r.bound * foot.sense[ALONG], h, r);
  leg.hip[UP].carry(lifted, t.at.push);
  if (leg.turned) carry_across(t, i);
}

inline void move_lane(const Legged& s, Legged& t, int k, double h, const LegTangents& of, int lane) {
  clear_body(t);
  for (int i = 0; i < t.legs(); i++) {
    const OwnPart& own = of.own[size_t(i) * LANES + lane];
    if (t.feet[i].contact == AIR) fly_lane(s, t, i, k, h, of.feet[i], own);
    if (t.feet[i].contact == SLIPPING) slide_lane(s, t, i, k, h, of.feet[i], own);
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
  if (!BodyMatrix(s, k, h, of).factor(of.solver)) return false;
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
