// Derivatives of the energies of a step: half of their difference over two perturbed copies of it, along a lane.
//
// They are sums of products of what the rows hold, so that the difference is exact but for the curvature of a film's law.
#pragma once
#include "derive/legged_perturbed.hpp"

namespace tarsus::legged {

constexpr double PERTURBATION = 1e-5;  // part of themselves by which rows move: it leaves 1e-10 of curvature, and of rounding 1e-11

// A perturbed copy of the run's step: everything that its energies depend on moved by ``by`` along a lane.
struct PerturbedStep {
  Legged s;
  std::vector<double> parameters;

  // facets: of the legs, none of level ground.
  PerturbedStep(const Legged& run, const Legged& lane, const DataTangents& data, const std::vector<FacetOf<Jet>>& facets, int number, double by)
      : s(run) {
    s.energy = {};
    s.shares.clear();
    for (size_t n = 0; n < data.parameters.size(); n++) {
      parameters.push_back(run.laws.parameters[n] + by * data.parameters[n][number]);
    }
    s.laws.take(parameters.data());
    for (size_t c = 0; c < s.channels.size(); c++) s.channels[c] += lane.channels[c] * by;
    for (int b = 0; b < s.coordinates(); b++) {
      s.body.weight[b] += by * lane.body.weight[b];
      s.at.v[b] += lane.at.v[b] * by;
      s.at.x[b] += lane.at.x[b] * by;
    }
    for (int i = 0; i < s.legs(); i++) {
      s.body.legs[i].gap += by * lane.body.legs[i].gap;
      LegRows& r = s.rows[i];
      const LegRows& d = lane.rows[i];
      for (int e = 0; e < DIRECTIONS; e++) {
        s.feet[i].u[e] += by * lane.feet[i].u[e];
        s.feet[i].w[e] += by * lane.feet[i].w[e];
        r.load[e] += d.load[e] * by;
        r.q[e] += d.q[e] * by;
        r.u[e] += d.u[e] * by;
        r.w[e] += d.w[e] * by;
      }
      r.bound += d.bound * by;
      for (Row LegRows::*part : {&LegRows::film, &LegRows::gap, &LegRows::rate, &LegRows::smooth}) {
        r.*part += d.*part * by;
      }
      if (!facets.empty()) turn_facet(i, lane, facets[i], number, by);
      if (!s.feet[i].filmed()) continue;
      // the copy's momentum counts from its own value at the gap at which the run's has its base
      LeggedFoot& foot = s.feet[i];
      const double more = s.laws.momentum(s.body.legs[i].foot, foot.from) - foot.base;
      foot.base += more;
      for (int d = 0; d < DIRECTIONS; d++) {
        const double gained = s.film_share(i, d) * more / s.body.legs[i].mass;
        foot.w[d] += gained;
        r.w[d] += gained;
      }
      r.film -= more;
    }
  }

 private:
  // Of uneven ground: the facet below a foot, and a foot on it in the directions of that; a lane lives in those of the run.
  void turn_facet(int i, const Legged& lane, const FacetOf<Jet>& facet, int number, double by) {
    if (s.body.legs[i].foot < 0) return;
    const auto moved = [&](double& to, const Jet& at) { to += by * at.slope[number]; };
    LeggedFoot& foot = s.feet[i];
    LegRows& r = s.rows[i];
    s.level[i].gap += by * lane.level[i].gap;
    for (int d = 0; d < DIRECTIONS; d++) s.level[i].weight[d] += by * lane.level[i].weight[d];
    moved(foot.ground.x, facet.x);
    moved(foot.ground.z, facet.z);
    moved(foot.ground.cos, facet.cos);
    moved(foot.ground.sin, facet.sin);
    float_above(s, i);
    if (foot.contact == AIR) return;
    turn_leg(s, i);
    const double lean = by * leaning(facet)[number];
    rotate(foot.u, 1.0, lean);
    rotate(foot.w, 1.0, lean);
    r.u[ALONG] += foot.u[UP] * lean;
    r.q[ALONG] += foot.u[UP] * (lean * s.level[i].stiffness[ALONG]);  // by its tables it moves as before, from elsewhere
    const Row up = r.load[UP];
    r.load[UP] -= r.load[ALONG] * lean;
    r.load[ALONG] += up * lean;
  }
};

// How far along a lane a perturbed step may lie.
inline double size_of(const Legged& s, const Legged& lane, const DataTangents& data, int number) {
  double out = INF;
  const auto hold = [&](double size, double moves) {
    if (size > 0.0 && moves > 0.0) out = std::min(out, PERTURBATION * size / moves);
  };
  double u = 0.0, w = 0.0, q = 0.0, du = 0.0, dw = 0.0, dq = 0.0;
  const auto grow = [](double& to, const Row& by) { to = std::max(to, highest(magnitude(by))); };
  for (int i = 0; i < s.legs(); i++) {
    for (int d = 0; d < DIRECTIONS; d++) {
      if (s.feet[i].held(d)) continue;
      const LegRows &r = s.rows[i], &t = lane.rows[i];
      grow(u, r.u[d]);
      grow(w, r.w[d]);
      grow(q, r.q[d]);
      grow(du, t.u[d]);
      grow(dw, t.w[d]);
      grow(dq, t.q[d]);
    }
  }
  for (int b = 0; b < s.coordinates(); b++) {
    grow(w, s.at.v[b] * s.body.lever[b]);
    grow(dw, lane.at.v[b] * s.body.lever[b]);
  }
  hold(u, du);
  hold(w, dw);
  hold(q, dq);
  for (size_t n = 0; n < data.parameters.size(); n++) {
    hold(std::fabs(s.laws.parameters[n]), std::fabs(data.parameters[n][number]));
  }
  return std::isfinite(out) ? out : 1.0;
}

// Add the derivatives of the energies of the step up to scaled time ``fraction`` to those of the lanes.
inline void add_power(const Legged& s, std::vector<Legged>& lanes, const std::vector<PerturbedWalker>& structures, const DataTangents& data,
                      const std::vector<FacetOf<Jet>>& facets, double h, double fraction) {
  Choices choices;
  Moment end, moved;
  end.legs.resize(DIRECTIONS * s.body.legs.size());
  moved.legs = end.legs;
  motion_at(s, h, fraction, end);
  Legged plain = s;
  plain.shares.clear();
  add_energies(plain, h, fraction, end, &choices);
  choices.again = true;
  for (const PerturbedWalker& one : structures) {
    Legged other = one.s;
    other.energy = {};
    motion_at(other, h, fraction, moved);
    choices.next = 0;
    add_energies(other, h, fraction, moved, &choices);
    for (int e = 0; e < ENERGIES; e++) (&lanes[one.lane].energy.work)[e] += one.weight * (&other.energy.work)[e];
  }
  for (size_t n = 0; n < lanes.size(); n++) {
    Legged& lane = lanes[n];
    const double size = size_of(s, lane, data, int(n));
    motion_at(lane, h, fraction, moved);
    for (double sign : {1.0, -1.0}) {
      PerturbedStep copy(s, lane, data, facets, int(n), sign * size);
      Moment there = end;
      for (size_t m = 0; m < there.legs.size(); m++) there.legs[m].u += sign * size * moved.legs[m].u;
      choices.next = 0;
      add_energies(copy.s, h, fraction, there, &choices);
      for (int e = 0; e < ENERGIES; e++) (&lane.energy.work)[e] += sign * 0.5 / size * (&copy.s.energy.work)[e];
    }
  }
}

}  // namespace tarsus::legged
