// The derivative of a walker's run by a number of its structure: perturbed copies of the walker that differ in it alone.
// Each makes its legs' steps from the run's own state, for the run's own motion of the body, films and forces, so that the weighted
// difference of their results is the number's own part; all else follows from it as for every other number. No equations are solved
// for the copies.
#pragma once
#include "derive/legged_tangent_step.hpp"
#include "derive/run.hpp"
#include "legged/profile.hpp"

namespace tarsus::legged {

// By what a facet turns.
inline Row leaning(const FacetOf<Jet>& facet) { return slope_of(facet.sin) * facet.cos.value - slope_of(facet.cos) * facet.sin.value; }

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
    for (int i = 0; i < s.legs(); i++) s.body.legs[i].gap = run.profile != nullptr ? run.level[i].gap : run.body.legs[i].gap;
    s.profile = run.profile;
    s.laws.patches = run.laws.patches;
    s.level = s.body.legs;
    s.level_gain = s.body.gain;
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
    for (int i : s.body.leg) {
      if (s.profile == nullptr) break;
      float_above(s, i);
      if (s.feet[i].contact != AIR) turn_leg(s, i);
    }
    load_feet(s);
    assemble_coupling(s);
    clear_body(s);
    for (int i = 0; i < s.legs(); i++) {
      if (s.feet[i].contact == AIR) {
        fly(i, k, h);
        continue;
      }
      if (s.feet[i].contact == SLIPPING) {
        const Row own = s.rows[i].load[ALONG] - s.rows[i].bound * s.feet[i].sense[ALONG];
        move(i, ALONG, k, own);
        carry_free(s, i, ALONG, own, h, s.rows[i]);
        if (s.body.legs[i].turned) carry_across(s, i);
      }
      find_margin(s, i);
    }
  }

  // Misfit of the body's momentum, at the run's own motion of it.
  Row misfit(int b, double h) const { return momentum_of(s, b, h) - (s.at.v[b] - s.v[b]) * s.body.mass[b]; }

  // Its body at the nodes.
  void finish(double h) { body_of_momentum(s, h); }

 private:
  void move(int i, int d, int k, const Row& own) {
    const Leg& leg = s.body.legs[i];
    const LegStep& table = s.tables.of(k, leg.kind[d]);
    LegRows& r = s.rows[i];
    r.q[d] = own + spring(s, leg, d);
    if (leg.turned) r.q[d] = OnSlope(leg, table, s.feet[i]).acting(r.q[d] - s.feet[i].u[UP] * leg.cross_stiffness);
    free_motion(table, s.feet[i].u[d], s.feet[i].w[d], r.q[d], r.u[d], r.w[d]);
  }

  void fly(int i, int k, double h) {
    const Leg& leg = s.body.legs[i];
    LegRows& r = s.rows[i];
    for (int d = 0; d < DIRECTIONS; d++) {
      const LegStep& table = s.tables.of(k, leg.kind[d]);
      const double share = leg.normal[d];
      const Row own = s.feet[i].force && share != 0.0 ? r.load[d] + r.smooth * share : r.load[d];
      move(i, d, k, own);
      if (s.feet[i].film && share != 0.0) {
        r.u[d] += combine(&table.film[0][0][0], r.film) * share;
        r.w[d] += combine(&table.film[1][0][0], r.film) * share;
      }
      carry_free(s, i, d, own, h, r);
    }
    r.gap = leg.clearance(r.u[UP], r.u[ALONG]);
    r.rate = leg.leans() ? r.w[UP] * leg.normal[UP] + r.w[ALONG] * leg.normal[ALONG] : r.w[UP];
    if (s.feet[i].film) r.rate += r.film * (1.0 / leg.mass);
  }
};

}  // namespace tarsus::legged
