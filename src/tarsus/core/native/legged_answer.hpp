// How the body of a legged robot answers its own legs within a step: what lets the repetition of legged_step.hpp settle fast.
#pragma once
#include "legged.hpp"

namespace tarsus {

// Sum up what all feet do to the body, anew after a contact changed.
inline void gather(Legged& s) {
  s.together = {};
  s.solved = -1;
  for (int i = 0; i < s.legs(); i++) {
    const Leg& leg = s.body.legs[i];
    for (int d = 0; d < DIRECTIONS; d++) {
      const Hip& hip = leg.hip[d];
      const bool held = s.feet[i].held(d);
      for (int n = 0; n < hip.count; n++) {
        const int b = hip.at[n];
        if (held) s.together.offset[b] += hip.by[n] * leg.stiffness[d] * s.feet[i].u[d];
        for (int l = 0; l < hip.count; l++) {
          const int c = hip.at[l];
          const double by = hip.by[n] * hip.by[l];
          if (held) {
            s.together.stiffness[b][c] += by * leg.stiffness[d];
            s.together.damping[b][c] += by * leg.damping[d];
          } else {
            s.together.mass[d][b][c] += by * leg.mass;
          }
        }
      }
    }
  }
}

// What the legs take from the body that is displaced by rows x over a step of class k: held ones through spring and damper,
// those in the air by following with their mass. All that are in the air are taken to move as the first leg would.
struct Answer {
  const Together& all;
  const Nodes& nodes;
  const LegStep* leg[DIRECTIONS];
  const double h;
  const int size;

  Answer(const Legged& s, int k) : all(s.together), nodes(s.nodes), h(s.tables.lengths[k]), size(s.coordinates()) {
    for (int d = 0; d < DIRECTIONS; d++) leg[d] = &s.tables.of(k, s.body.legs[0].kind[d]);
  }

  // What displacements of all coordinates take from the momentum of b [N s].
  Row momentum(int b, const Row* x) const {
    Row push = Row(0.0), out = Row(0.0);
    for (int c = 0; c < size; c++) {
      push += x[c] * all.stiffness[b][c];
      out += x[c] * all.damping[b][c];
    }
    out += combine(&nodes.once[0][0], push) * h;
    return out + following(b, x, 1, -1);
  }

  // What displacements of the other coordinates take from the integral of b's momentum [kg m].
  Row place(int b, const Row* x) const {
    Row push = Row(0.0), drag = Row(0.0);
    for (int c = 0; c < size; c++) {
      if (c == b) continue;
      push += x[c] * all.stiffness[b][c];
      drag += x[c] * all.damping[b][c];
    }
    return combine(&nodes.twice[0][0], push) * (h * h) + combine(&nodes.once[0][0], drag) * h + following(b, x, 0, b);
  }

  // Whether other coordinates take anything from b.
  bool linked(int b) const {
    for (int c = 0; c < size; c++) {
      const bool held = all.stiffness[b][c] != 0.0 || all.damping[b][c] != 0.0;
      if (c != b && (held || all.mass[UP][b][c] != 0.0 || all.mass[ALONG][b][c] != 0.0)) return true;
    }
    return false;
  }

  // Columns of (mass + what b takes from its own place)^-1. Its largest terms are on the diagonal for the lengths in use.
  void invert(int b, double mass, Row* solver) const {
    Row left[N];
    for (int r = 0; r < N; r++) {
      left[r] = load(nodes.once[r]) * (all.damping[b][b] * h) + load(nodes.twice[r]) * (all.stiffness[b][b] * h * h);
      for (int d = 0; d < DIRECTIONS; d++) left[r] += load(leg[d]->follow[0][r]) * all.mass[d][b][b];
      left[r].set(r, left[r][r] + mass);
      solver[r] = Row(0.0);
      solver[r].set(r, 1.0);
    }
    for (int p = 0; p < N; p++) {
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

 private:
  // Of the feet in the air, by their rate (1) or displacement (0).
  TARSUS_INLINE Row following(int b, const Row* x, int v, int but) const {
    Row out = Row(0.0);
    for (int d = 0; d < DIRECTIONS; d++) {
      if (all.mass[d][b][b] == 0.0) continue;
      Row sum = Row(0.0);
      for (int c = 0; c < size; c++) {
        if (c != but) sum += x[c] * all.mass[d][b][c];
      }
      out += combine(&leg[d]->follow[v][0][0], sum);
    }
    return out;
  }
};

inline void make_solvers(Legged& s, int k) {
  if (s.solved == k) return;
  s.solved = k;
  const Answer answer(s, k);
  for (int b = 0; b < s.coordinates(); b++) answer.invert(b, s.body.mass[b], s.solver[b]);
}

constexpr int ROUNDS_OF_ANSWERS = 2;
constexpr double ALONE = 30.0;  // a coordinate taken alone leaves less than this share of a change to the others, inverted

// The body's motion at the nodes from what the legs did. Returns the largest change of a hip [m].
inline double follow(Legged& s, int k, double h) {
  BodyRows& at = s.at;
  const Answer answer(s, k);
  const double* once = &s.nodes.once[0][0];
  Row misfit[MOST_COORDINATES], step[MOST_COORDINATES];
  const auto change = [&] {
    double out = 0.0;
    for (int b = 0; b < s.coordinates(); b++) {
      if (!finite(step[b])) return NOT_A_NUMBER;
      out = std::max(out, highest(magnitude(step[b])) * s.body.lever[b]);
    }
    return out;
  };
  for (int b = 0; b < s.coordinates(); b++) {
    const double mass = s.body.mass[b];
    const Row place = combine(&s.nodes.twice[0][0], at.push[b]) * (h * h) + combine(once, at.drag[b]) * h - at.place[b];
    // the new place first: what rounding leaves of its difference from the old is then nothing, or more than it can hold
    misfit[b] = (place * (1.0 / mass) + s.nodes.times() * (h * s.v[b]) + s.x[b] - at.x[b]) * mass;
    step[b] = combine(reinterpret_cast<const double*>(s.solver[b]), misfit[b]);
  }
  double moved = change();
  if (moved > ALONE * 1e-3 * s.settings.gap) {
    for (int n = 0; n < ROUNDS_OF_ANSWERS; n++) {
      for (int b = 0; b < s.coordinates(); b++) {
        if (!answer.linked(b)) continue;
        step[b] = combine(reinterpret_cast<const double*>(s.solver[b]), misfit[b] - answer.place(b, step));
      }
    }
    moved = change();
  }
  for (int b = 0; b < s.coordinates(); b++) {
    const Row momentum = combine(once, at.push[b]) * h - at.momentum[b] + at.drag[b] - answer.momentum(b, step);
    at.v[b] = momentum * (1.0 / s.body.mass[b]) + s.v[b];
    at.x[b] += step[b];
  }
  return moved;
}

}  // namespace tarsus
