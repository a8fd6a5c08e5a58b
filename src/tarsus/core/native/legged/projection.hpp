// The body of a legged robot under the forces of its own legs within a step: a projection that includes the legs' first-order
// response to the body, so that the repetition of legged/step.hpp converges fast.
#pragma once
#include <cstring>

#include "base/dense.hpp"
#include "legged/legged.hpp"

namespace tarsus::legged {

// Of a foot that sticks on a slope: what its springs and dampers couple of the facet's two directions.
inline void couple_across(Legged& s, int i) {
  const Leg& leg = s.body.legs[i];
  for (int d = 0; d < DIRECTIONS; d++) {
    const Hip &hip = leg.hip[d], &other = leg.hip[1 - d];
    for (int n = 0; n < hip.count; n++) {
      s.coupling.offset[hip.at[n]] += hip.by[n] * leg.cross_stiffness * s.feet[i].u[1 - d];
      for (int l = 0; l < other.count; l++) {
        s.coupling.stiffness[hip.at[n]][other.at[l]] += hip.by[n] * other.by[l] * leg.cross_stiffness;
        s.coupling.damping[hip.at[n]][other.at[l]] += hip.by[n] * other.by[l] * leg.cross_damping;
      }
    }
  }
}

// Sum up the forces of all feet on the body and within it (Coupling), once more after each change of a contact.
inline void assemble_coupling(Legged& s) {
  s.coupling = {};
  const int nb = s.coordinates();
  for (int b = 0; b < nb; b++) {
    std::copy_n(&s.body.stiffness[b * nb], nb, s.coupling.stiffness[b]);
    std::copy_n(&s.body.damping[b * nb], nb, s.coupling.damping[b]);
  }
  std::vector<bool> contacts;
  for (int i = 0; i < s.legs(); i++) {
    const Leg& leg = s.body.legs[i];
    for (int d = 0; d < s.directions(); d++) {
      const Hip& hip = leg.hip[d];
      const bool held = s.feet[i].held(d);
      contacts.push_back(held);
      for (int n = 0; n < hip.count; n++) {
        const int b = hip.at[n];
        if (held) s.coupling.offset[b] += hip.by[n] * leg.stiffness[d] * s.feet[i].u[d];
        for (int l = 0; l < hip.count; l++) {
          const int c = hip.at[l];
          const double by = hip.by[n] * hip.by[l];
          if (held) {
            s.coupling.stiffness[b][c] += by * leg.stiffness[d];
            s.coupling.damping[b][c] += by * leg.damping[d];
          } else {
            s.coupling.mass[d][b][c] += by * leg.mass;
          }
        }
      }
    }
    if (!leg.turned) continue;
    for (double of : {s.feet[i].ground.cos, s.feet[i].ground.sin}) {  // the solvers are of these slopes alone
      uint64_t bits;
      std::memcpy(&bits, &of, sizeof bits);
      for (int b = 0; b < 64; b++) contacts.push_back((bits >> b) & 1);
    }
    if (s.feet[i].held(ALONG)) couple_across(s, i);
  }
  if (s.kept_solvers.size() >= MOST_CONTACT_SETS) s.kept_solvers.clear();
  s.solvers = &s.kept_solvers[contacts];
  s.solvers->resize(s.tables.classes());
}

// The response of the legs to rows x of the body's displacement over a step of class k: held legs push back through spring and
// damper, those in the air follow with their mass. All legs in the air are assumed to move as the first leg would.
struct Projection {
  static constexpr double LINK = 1e-3;

  const Coupling& all;
  const Nodes& nodes;
  const LegStep* leg[MOST_DIRECTIONS];
  const double h;
  const int size, directions;

  Projection(const Legged& s, int k) : all(s.coupling), nodes(s.nodes), h(s.tables.lengths[k]), size(s.coordinates()), directions(s.directions()) {
    for (int d = 0; d < directions; d++) leg[d] = &s.tables.of(k, s.body.legs[0].kind[d]);
  }

  // The momentum of b [N s] under a push and a drag, less the legs' response to displacements of all coordinates.
  TARSUS_INLINE Row momentum(int b, Row push, Row drag, const Row* x) const {
    for (int c = 0; c < size; c++) {
      push -= x[c] * all.stiffness[b][c];
      drag -= x[c] * all.damping[b][c];
    }
    return combine(&nodes.once[0][0], push) * h + drag - following(b, x, 1, -1);
  }

  // The legs' response to displacements of the other coordinates, in the integral of b's momentum [kg m].
  Row place(int b, const Row* x) const {
    Row push = Row(0.0), drag = Row(0.0);
    for (int c = 0; c < size; c++) {
      if (c == b) continue;
      push += x[c] * all.stiffness[b][c];
      drag += x[c] * all.damping[b][c];
    }
    return combine(&nodes.twice[0][0], push) * (h * h) + combine(&nodes.once[0][0], drag) * h + following(b, x, 0, b);
  }

  // Whether the legs couple other coordinates to b by more than LINK of its inertia, weighted by what moves a hip: a weaker
  // coupling is left to the repetition, each sweep of which leaves that share of its error.
  bool linked(int b, const Body& body) const {
    double share = 0.0;
    for (int c = 0; c < size; c++) {
      if (c == b) continue;
      double mass = 0.5 * h * h * std::fabs(all.stiffness[b][c]) + h * std::fabs(all.damping[b][c]);
      for (int d = 0; d < directions; d++) mass += std::fabs(all.mass[d][b][c]);
      share += mass * body.lever[b] / (body.mass[b] * body.lever[c]);
    }
    return share > LINK;
  }

  // Columns of (mass + the legs' response to b's own displacement)^-1; false where the matrix is singular.
  bool invert(int b, double mass, Row* solver) const {
    Row columns[N];
    for (int r = 0; r < N; r++) {
      columns[r] = load(nodes.once[r]) * (all.damping[b][b] * h) + load(nodes.twice[r]) * (all.stiffness[b][b] * h * h);
      for (int d = 0; d < directions; d++) columns[r] += load(leg[d]->follow[0][r]) * all.mass[d][b][b];
      columns[r].set(r, columns[r][r] + mass);
    }
    return invert_columns(columns, solver);
  }

 private:
  // Momentum of the feet in the air, by their rate (v = 1) or displacement (0); ``but``: a coordinate excluded.
  TARSUS_INLINE Row following(int b, const Row* x, int v, int but) const {
    Row out = Row(0.0);
    for (int d = 0; d < MOST_DIRECTIONS; d++) {
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

TARSUS_APART inline std::shared_ptr<const Solvers> make_solvers(const Legged& s, int k) {
  auto out = std::make_shared<Solvers>();
  const Projection projection(s, k);
  out->inverse.resize(s.coordinates());
  out->linked.resize(s.coordinates());
  for (int b = 0; b < s.coordinates(); b++) {
    out->linked[b] = projection.linked(b, s.body);
    if (projection.invert(b, s.body.mass[b], out->inverse[b].data())) continue;
    for (int r = 0; r < N; r++) {  // as if there were no legs
      out->inverse[b][r] = Row(0.0);
      out->inverse[b][r].set(r, 1.0 / s.body.mass[b]);
    }
  }
  return out;
}

// Of the present contacts, for steps of class k.
inline const Solvers& solvers_of(Legged& s, int k) {
  std::shared_ptr<const Solvers>& place = (*s.solvers)[k];
  if (!place) place = make_solvers(s, k);
  return *place;
}

constexpr int PROJECTION_ROUNDS = 2;
constexpr double ALONE = 30.0;  // inverse of the largest share of a change that solving a coordinate alone leaves to the others

// The body's motion at the nodes under the forces of the legs. Returns the largest change of a hip [m].
inline double follow(Legged& s, int k, double h) {
  BodyRows& at = s.at;
  const Projection projection(s, k);
  const Solvers& solvers = solvers_of(s, k);
  const auto solve = [&](int b, const Row& right) { return combine(reinterpret_cast<const double*>(solvers.inverse[b].data()), right); };
  const int nb = s.coordinates();
  const double* once = &s.nodes.once[0][0];
  Row misfit[MOST_COORDINATES], step[MOST_COORDINATES];
  const auto change = [&] {
    double out = 0.0;
    for (int b = 0; b < nb; b++) {
      if (!finite(step[b])) return NOT_A_NUMBER;
      out = std::max(out, highest(magnitude(step[b])) * s.body.lever[b]);
    }
    return out;
  };
  for (int b = 0; b < nb; b++) {
    const double mass = s.body.mass[b];
    const Row place = combine(&s.nodes.twice[0][0], at.push[b]) * (h * h) + combine(once, at.drag[b] + at.film[b]) * h - at.place[b];
    // the new place is rounded first, so that its difference from the old one is exactly zero or above rounding
    misfit[b] = (place * (1.0 / mass) + s.nodes.times() * (h * s.v[b]) + s.x[b] - at.x[b]) * mass;
    step[b] = solve(b, misfit[b]);
  }
  double moved = change();
  if (moved > ALONE * CONVERGED * s.settings.gap) {
    for (int n = 0; n < PROJECTION_ROUNDS; n++) {
      for (int b = 0; b < nb; b++) {
        if (solvers.linked[b]) step[b] = solve(b, misfit[b] - projection.place(b, step));
      }
    }
    moved = change();
  }
  for (int b = 0; b < nb; b++) {
    at.v[b] = (projection.momentum(b, at.push[b], at.drag[b], step) - at.momentum[b]) * (1.0 / s.body.mass[b]) + s.v[b];
    at.x[b] += step[b];
  }
  return moved;
}

}  // namespace tarsus::legged
