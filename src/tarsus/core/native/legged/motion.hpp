// Motion of a legged robot at any moment within a step whose nodes are known.
//
// From the last node before, each leg moves on by the tables of shorter steps, halving, until its own
// equation can be expanded in a Taylor series in time; the polynomials that act on it are moved along. The
// body follows from momentum as at the nodes.
#pragma once
#include "legged/legged.hpp"

namespace tarsus::legged {

constexpr int LEG_TERMS = 40;
constexpr double LEG_REACH = 2.0;  // largest rate times time over which the Taylor series keeps 15 digits

struct Motion {
  double u, w;
};

// Coefficients of p(x + by) from those of p(x), in place.
inline void shift(double* coefficients, double by) {
  for (int n = 0; n < N - 1; n++) {
    for (int c = N - 2; c >= n; c--) coefficients[c] += by * coefficients[c + 1];
  }
}

// u and w after ``span`` of a step h under a force and a film momentum in powers of the scaled time, by
// Taylor series.
inline Motion expand(const Leg& leg, int d, double h, double span, Motion from, const double* push,
                     const double* film) {
  const bool more = leg.turned && d == ALONG;  // by its tables' own, as its forces are (legged/profile.hpp)
  const double step = h * span, m = 1.0 / leg.mass, stiffness = more ? leg.stiffness[d] - leg.more_stiffness : leg.stiffness[d],
               damping = more ? leg.damping[d] - leg.more_damping : leg.damping[d];
  const double enough = 1e-18 * (std::fabs(from.u) + step * std::fabs(from.w)) + 1e-40;
  Motion sum = from, term = from;
  double powers[N] = {1.0}, forces[N], momenta[N] = {};
  for (int n = 1; n < N; n++) powers[n] = powers[n - 1] * span;
  store(forces, load(push) * load(powers));
  if (film != nullptr) store(momenta, load(film) * load(powers));
  const auto add = [&](double du, double dw) {
    sum.u += du;
    sum.w += dw;
    term = {du, dw};
  };
  for (int n = 0; n < N; n++) {
    const double factor = step / (n + 1), pulled = forces[n] - stiffness * term.u - damping * term.w;
    if (film != nullptr) {
      const double momentum = momenta[n];
      add(factor * (term.w + momentum * m), factor * (pulled * m - damping * momentum * m * m));
    } else {
      add(factor * term.w, factor * (pulled * m));
    }
  }
  for (int n = N; n < LEG_TERMS - 1; n++) {  // by now under no force but its own
    const double factor = step / (n + 1);
    add(factor * term.w, factor * ((0.0 - stiffness * term.u - damping * term.w) * m));
    // velocities over the span are displacements: both are small in the same unit
    if (std::fabs(term.u) + step * std::fabs(term.w) < enough) break;
  }
  return sum;
}

// u and w at the end of a stretch that is a whole step of another class, ``width`` of the step of the
// polynomials.
inline Motion by_tables(const Legged& s, const LegStep& table, double width, Motion from, const double* push,
                        const double* film) {
  const Row x = s.nodes.times() * width;
  Row force = Row(push[N - 1]), momentum = Row(0.0);
  for (int c = N - 2; c >= 0; c--) force = force * x + push[c];
  Motion to = {table.state[0][N - 1] * from.u + table.state[1][N - 1] * from.w +
                   total(load(table.force_end[0]) * force),
               table.state[2][N - 1] * from.u + table.state[3][N - 1] * from.w +
                   total(load(table.force_end[1]) * force)};
  if (film != nullptr) {
    for (int c = N - 1; c >= 0; c--) momentum = momentum * x + film[c];
    to.u += total(load(table.film_end[0]) * momentum);
    to.w += total(load(table.film_end[1]) * momentum);
  }
  return to;
}

// u and w of a leg that nothing holds in direction d, at scaled time ``fraction`` of the step.
inline Motion leg_at(const Legged& s, int i, int d, double h, double fraction) {
  const Leg& leg = s.body.legs[i];
  const LeggedFoot& foot = s.feet[i];
  const LegRows& r = s.rows[i];
  int node = 0;
  while (node < N - 2 && s.nodes.tau[node + 1] <= fraction) node++;
  Motion at = node == 0 ? Motion{foot.u[d], foot.w[d]} : Motion{r.u[d][node], r.w[d][node]};
  double left = fraction - s.nodes.tau[node];
  if (left <= 0.0) return at;
  double push[N], momentum[N];
  double* film = s.films(i, d) ? momentum : nullptr;
  store(push, combine(&s.between.about[node][0][0], r.q[d]));
  if (film != nullptr) store(film, combine(&s.between.about[node][0][0], s.film_row(i, d)));
  const int kind = leg.kind[d];
  const double rate = s.tables.rate[kind] * h;
  // far from the node for the block's own rate: by the tables of shorter steps first
  double width = 0.5;
  for (int k = s.step_class + 1; rate * left > LEG_REACH && k < s.tables.classes(); k++, width *= 0.5) {
    if (width > left) continue;
    at = by_tables(s, s.tables.of(k, kind), width, at, push, film);
    left -= width;
    shift(push, width);
    if (film != nullptr) shift(film, width);
  }
  return expand(leg, d, h, left, at, push, film);
}

// Displacement and rate of a free foot in direction d.
inline Motion foot_at(const Legged& s, int i, int d, double h, double fraction) {
  Motion at = leg_at(s, i, d, h, fraction);
  if (const double share = s.film_share(i, d)) at.w += share * s.polynomial_at(s.rows[i].film, fraction) / s.body.legs[i].mass;
  return at;
}

// Gap [m] and its rate [m/s] of a free foot at scaled time ``fraction``.
inline Motion gap_at(const Legged& s, int i, double h, double fraction) {
  const Leg& leg = s.body.legs[i];
  Motion at = foot_at(s, i, UP, h, fraction);
  if (!leg.is_tilted()) return {leg.clearance(at.u, 0.0), at.w};
  const Motion along = foot_at(s, i, ALONG, h, fraction);
  return {leg.clearance(at.u, along.u), at.w * leg.normal[UP] + along.w * leg.normal[ALONG]};
}

// Values of the Lagrange polynomials at scaled time s.
inline Row lagrange(const Nodes& nodes, double s) {
  Row out = load(nodes.monomial[N - 1]);
  for (int c = N - 2; c >= 0; c--) out = out * s + load(nodes.monomial[c]);
  return out;
}

// Whether the polynomials through the nodes represent the leg's own motion, to far less than a step's tolerance.
constexpr double REPRESENTED = 1e-5;
inline bool smooth(const Legged& s, const LegRows& r, int d, double h) {
  return s.nodes.truncation(r.u[d]) + s.nodes.truncation(r.w[d]) * h <= REPRESENTED * s.settings.gap;
}

// The integral from 0 to s of the polynomial through nodal values, once or twice.
inline double integral_at(const Legged& state, const Row& values, double s) {
  double line[N];
  store(line, state.powers(values));
  double out = 0.0;
  for (int c = N - 1; c >= 0; c--) out = out * s + line[c] / (c + 1);
  return out * s;
}

inline double integral_twice_at(const Legged& state, const Row& values, double s) {
  double line[N];
  store(line, state.powers(values));
  double out = 0.0;
  for (int c = N - 1; c >= 0; c--) out = out * s + line[c] / ((c + 1) * (c + 2));
  return out * s * s;
}

// State of the body and of every leg at one moment.
struct Moment {
  double x[MOST_COORDINATES], v[MOST_COORDINATES];
  std::vector<Motion> legs;  // (legs, directions)
  int directions = DIRECTIONS;
  Motion& of(int i, int d) { return legs[size_t(directions) * size_t(i) + d]; }
};

inline void end_of_step(const Legged& s, Moment& out) {
  for (int b = 0, nb = s.coordinates(); b < nb; b++) {
    out.x[b] = s.at.x[b][N - 1];
    out.v[b] = s.at.v[b][N - 1];
  }
  for (int i = 0, legs = s.legs(); i < legs; i++) {
    in_directions<UP>(s, [&](auto d) {
      const bool held = s.feet[i].held(d);
      out.of(i, d) =
          held ? Motion{s.feet[i].u[d], 0.0} : Motion{s.rows[i].u[d][N - 1], s.rows[i].w[d][N - 1]};
    });
  }
}

// State at scaled time ``fraction`` of the step.
inline void motion_at(const Legged& s, double h, double fraction, Moment& out) {
  if (fraction >= 1.0) return end_of_step(s, out);
  const int nb = s.coordinates();
  const Row here = lagrange(s.nodes, fraction);
  for (int b = 0; b < nb; b++) {
    out.x[b] =
        integral_twice_at(s, s.at.push[b], fraction) * h * h + integral_at(s, s.at.drag[b], fraction) * h;
    out.v[b] = integral_at(s, s.at.push[b], fraction) * h + s.polynomial_at(s.at.drag[b], fraction);
  }
  for (int i = 0; i < s.legs(); i++) {
    const Leg& leg = s.body.legs[i];
    const LeggedFoot& foot = s.feet[i];
    for (int d = 0; d < s.directions(); d++) {
      out.of(i, d) = {foot.u[d], 0.0};
      if (foot.held(d)) continue;
      const LegRows& r = s.rows[i];
      const Motion to = smooth(s, r, d, h) ? Motion{total(r.u[d] * here), total(r.w[d] * here)} : leg_at(s, i, d, h, fraction);
      out.of(i, d) = to;
      double place = leg.mass * (to.u - foot.u[d] - foot.w[d] * fraction * h);
      if (s.films(i, d)) place -= integral_at(s, s.film_row(i, d), fraction) * h;
      leg.hip[d].carry(-place, out.x);
      leg.hip[d].carry(-leg.mass * (to.w - foot.w[d]), out.v);
    }
  }
  for (int b = 0; b < nb; b++) {
    out.x[b] = out.x[b] / s.body.mass[b] + s.x[b] + s.v[b] * fraction * h;
    out.v[b] = out.v[b] / s.body.mass[b] + s.v[b];
  }
}

}  // namespace tarsus::legged
