// The derivative of a walker's run by a number of its structure: perturbed copies of the walker that differ in it alone.
// Each makes its legs' steps from the run's own state, for the run's own motion of the body, films and forces, so that the weighted
// difference of their results is the number's own part; all else follows from it as for every other number. No equations are solved
// for the copies.
#pragma once
#include "derive/legged_tangent_step.hpp"

namespace tarsus::legged {

// A perturbed copy of the run's structure, its weight in the difference of a lane.
struct PerturbedBody {
  const Body* body;
  const LegTables* tables;
  double weight;
  int lane;
};

struct PerturbedWalker {
  Legged s;
  const Body& unit;  // its weights are those of unit gravity
  double weight;
  int lane;

  PerturbedWalker(const PerturbedBody& of, const Legged& run, const Signals& signals, const Laws& laws, size_t driven)
      : s(*of.body, *of.tables, run.nodes, run.between, signals, laws, run.units, run.log, driven), unit(*of.body), weight(of.weight),
        lane(of.lane) {}

  // Where the run begins.
  void begin(const Legged& run, const double* parameters, const double* gravity) {
    s.laws.take(parameters);
    s.settings = run.settings;
    s.settings.gap = s.settings.force_zero = 0.0;  // no change is small enough to be excluded from a difference
    s.shares.clear();
    s.body.weigh(unit, gravity);
    for (int i = 0; i < s.legs(); i++) s.body.legs[i].gap = run.body.legs[i].gap;
  }

  // Its legs over the run's step, and their forces on the body.
  void follow(const Legged& run, int k, double h) {
    std::copy_n(run.x, s.coordinates(), s.x);
    std::copy_n(run.v, s.coordinates(), s.v);
    s.feet = run.feet;
    s.channels = run.channels;
    s.rows = run.rows;
    s.at = run.at;
    s.clock.time = run.clock.time;
    s.step_class = k;
    load_feet(s);
    assemble_coupling(s);
    clear_body(s);
    for (int i = 0; i < s.legs(); i++) {
      if (s.feet[i].contact == AIR) {
        fly(i, k, h);
      } else {
        find_margin(s, i);
      }
      if (s.feet[i].contact == STUCK) continue;
      Row own = s.rows[i].load[ALONG];
      if (s.feet[i].contact == SLIPPING) own -= s.rows[i].bound[ALONG] * s.feet[i].sense[ALONG];
      move(i, ALONG, k, own);
      carry_free(s, i, ALONG, own, h, s.rows[i]);
    }
  }

  // Misfit of the body's momentum, at the run's own motion of it.
  Row misfit(int b, double h) const { return momentum_of(s, b, h) - (s.at.v[b] - s.v[b]) * s.body.mass[b]; }

  // Its body at the nodes.
  void finish(double h) { body_of_momentum(s, h); }

 private:
  void move(int i, int d, int k, const Row& own) {
    const Leg& leg = s.body.legs[i];
    LegRows& r = s.rows[i];
    r.q[d] = own + spring(s, leg, d);
    free_motion(s.tables.of(k, leg.kind[d]), s.feet[i].u[d], s.feet[i].w[d], r.q[d], r.u[d], r.w[d]);
  }

  void fly(int i, int k, double h) {
    const Leg& leg = s.body.legs[i];
    const LegStep& table = s.tables.of(k, leg.kind[UP]);
    LegRows& r = s.rows[i];
    const Row own = s.feet[i].force ? r.load[UP] + r.smooth : r.load[UP];
    move(i, UP, k, own);
    if (s.feet[i].film) {
      r.u[UP] += combine(&table.film[0][0][0], r.film);
      r.w[UP] += combine(&table.film[1][0][0], r.film);
    }
    r.gap = r.u[UP] + leg.gap;
    r.rate = s.feet[i].film ? r.w[UP] + r.film * (1.0 / leg.mass) : r.w[UP];
    carry_free(s, i, UP, own, h, r);
  }
};

}  // namespace tarsus::legged
