// A step of a structure with one foot, in the air under a film alone or held by a strength that grows with time: the
// same as attempt and scan for any feet, with all that belongs to the nodes in registers.
#pragma once
#include "modal/collocate.hpp"
#include "modal/scan.hpp"

namespace tarsus::modal {

// A film P = half / (g + thickness)^2 and a strength initial + rate age, of the one foot.
struct OneFoot {
  double half = 0.0, thickness = 1.0, initial = 0.0, rate = 0.0;
  bool films = false, in_line = false;  // whether the laws are such, in the air and on the ground
  bool in_film = false;                 // and the film of the run is not a strong one

  explicit OneFoot(const Modal& m) {
    if (m.sizes.feet != 1 || m.sizes.ways > 0) return;
    films = m.laws.film_alone() && m.laws.has(0, HAS_MOMENTUM) && !m.laws.has(0, HAS_FORCE) && !m.laws.has(0, USES_RATE);
    in_line = m.laws.linear_strength() && !m.laws.has(0, HAS_FORCE);
  }

  // Take the parameters of a run.
  void begin(const Modal& m) {
    in_film = films && !m.strong;
    if (in_film) {
      const double* p = m.laws.of(0, m.laws.laws.terms[MOMENTUM][0]);
      half = 0.5 * p[0];
      thickness = p[1];
    }
    if (in_line && !m.laws.laws.terms[STRENGTH].empty()) {
      const double* p = m.laws.of(0, m.laws.laws.terms[STRENGTH][0]);
      initial = p[0];
      rate = p[1];
    }
  }
};

// Newton's method for the nodal gaps; the columns of the 8 x 8 matrix are rows of the machine, eliminated without pivots.
// False where a pivot is small or it does not converge.
TARSUS_APART inline bool newton_one(const OneFoot& foot, const double* effect, const Row& linear, double tolerance, Row& gap,
                                    Row& film) {
  gap = Row(linear[0]);
  for (int n = 0; n < ITERATIONS; n++) {
    Row inverse = 1.0 / (gap + foot.thickness);
    film = foot.half * inverse * inverse;
    const Row slope = 2.0 * film * inverse;
    Row column[N], rest = linear - gap;
    for (int b = 0; b < N; b++) {
      const Row part = load(effect + N * b);
      rest += part * film[b];
      column[b] = part * slope[b];
      column[b].set(b, column[b][b] + 1.0);
    }
    const double misfit = highest(magnitude(rest));
    if (!solve_columns(column, rest)) return false;
    const double change = highest(magnitude(rest));
    if (any_not_below(magnitude(rest), Row(1e300))) return false;
    const Row from = gap;
    double damp = 1.0;
    for (int d = 0; d < HALVINGS; d++, damp *= 0.5) {
      gap = from + rest * damp;
      inverse = 1.0 / (gap + foot.thickness);
      film = foot.half * inverse * inverse;
      if (change * damp <= tolerance) return true;
      if (highest(magnitude(linear - gap + combine(effect, film))) < misfit) break;
    }
  }
  return false;
}

// linear + sum_j rows[j] x[j] in four short chains, since each sweep waits for the result. Rows of a table and the values at the nodes, or
// for eight runs at once numbers of a table and rows of values.
template <class Table, class Values>
TARSUS_INLINE Row combined(const Row& linear, const Table& rows, const Values& x) {
  const Row a = linear + rows[0] * x[0] + rows[4] * x[4], b = rows[1] * x[1] + rows[5] * x[5];
  const Row c = rows[2] * x[2] + rows[6] * x[6], d = rows[3] * x[3] + rows[7] * x[7];
  return (a + c) + (b + d);
}

// A film's momentum after a change of the gap that hardly moves it, by its series; before: that momentum, and 1/(g + g0).
TARSUS_INLINE Row film_after(const Row& film, const Row& inverse, const Row& change) {
  const Row x = change * inverse;
  return film * (1.0 + x * (3.0 * x - 2.0));
}

// For a change of the gap by this part of g + g0 the series above has the momentum to 4e-6 of itself.
constexpr double SLIGHT = 0.01;

// Sweeps for the nodal gaps from those under the first node's film, held constant; reach: how far a unit of momentum moves
// the gap. A change x of the gap changes the film P = half / (g + g0)^2 by 2 P x / (g + g0), and that moves the gap by no
// more than reach times as much: where half the tolerance is not exceeded, another sweep would find nothing.
TARSUS_INLINE bool sweep_one(const OneFoot& foot, const double* effect, const Row& linear, double tolerance, double reach, Row& gap,
                             Row& film) {
  const Row bound = Row(0.25 * tolerance / reach);
  Row rows[N];
  for (int j = 0; j < N; j++) rows[j] = load(effect + N * j);
  double before = INF;
  Row inverse, scaled;
  for (int n = 0; n < SWEEPS; n++) {
    reciprocals(gap + foot.thickness, Row(foot.half), inverse, scaled);
    const Row tried = scaled * inverse, found = combined(linear, rows, tried), change = found - gap, moved = magnitude(change);
    gap = found;
    const Row part = moved * inverse;
    if (!any_not_below(part * larger(tried, bound * (1.0 / SLIGHT)), bound)) {
      film = film_after(tried, inverse, change);
      return true;
    }
    const double most = highest(moved);
    if (any_not_below(moved, Row(1e300))) return false;
    if (n > 0 && most * most <= tolerance * std::max(before - most, 0.0)) {
      reciprocals(gap + foot.thickness, Row(foot.half), inverse, scaled);
      film = scaled * inverse;
      return true;
    }
    if (n > 2 && most > SLOWEST * before) return false;
    before = most;
  }
  return false;
}

// The gaps where the film is too stiff for sweeps.
TARSUS_INLINE bool solve_stiff(Modal& m, const OneFoot& foot, const StepClass& step, double t, const Row& linear, Row& gap,
                               Row& film) {
  if (newton_one(foot, step.from_input(0, 0), linear, CONVERGED_SHARE * m.settings.gap, gap, film)) return true;
  m.linear[0] = linear;
  if (!newton(m, step, t)) return false;
  gap = m.outputs[0];
  film = m.values[0];
  return true;
}

template <class S>
TARSUS_INLINE double attempt_free(Modal& m, const OneFoot& foot, const StepClass& step, double t) {
  m.drive(t, step.length);
  const Row linear = flowing_output<S>(m, step, 0), constant = step.from_constant(0, 0);
  const double *effect = step.from_input(0, 0), last = step.node_constant[N - 1];
  const double first = linear[0], height = first + foot.thickness, tolerance = CONVERGED_SHARE * m.settings.gap;
  if (!(m.film_now >= 0.0)) m.film_now = foot.half / (height * height);
  m.linear[0] = linear;
  m.room[0] = 0.0;
  Row gap, film;
  if (2.0 * m.film_now * std::fabs(last) > STIFFNESS * std::fabs(height)) {
    if (!solve_stiff(m, foot, step, t, linear, gap, film)) return NOT_CONVERGED;
  } else {
    gap = linear + constant * m.film_now;
    if (foot.half > 0.0 && any_less(gap, Row(first - DEEP * height))) {
      m.room[0] = height;
      runs_deep(m, 0, gap);
      return NOT_CONVERGED;
    }
    if (!sweep_one(foot, effect, linear, tolerance, step.reach[0], gap, film)) return NOT_CONVERGED;
  }
  m.outputs[0] = gap;
  m.values[0] = film;
  const double reach = step.reach[0], swing = std::fabs(gap[N - 1] - gap[0]);
  double error = m.nodes.truncation(film) * reach;
  if (swing > 0.0) error *= swing / (swing + reach * std::fabs(film[N - 1] - film[0]));
  const bool counts = error > 0.0;
  m.growth_before = counts ? std::fabs(film[0]) : 1.0;
  m.growth_after = counts ? std::fabs(film[N - 1]) : 1.0;
  return m.steady ? error * m.per_gap : std::max(error * m.per_gap, drive_error(m));
}

template <class S>
TARSUS_INLINE double attempt_held(Modal& m, const OneFoot& foot, const StepClass& step, double t) {
  m.drive(t, step.length);
  const Row pull = flowing_output<S>(m, step, 0);
  m.outputs[0] = pull;
  const double age = t - m.feet[0].since;
  m.margin[0] = (foot.initial + foot.rate * (age + m.nodes.times() * step.length)) - pull;
  m.growth_before = m.growth_after = 1.0;
  return drive_error(m);
}

// Whether the foot may have its event, by a bound of its margin's deviation from a straight line between nodes.
inline Scan scan_bounded(Modal& m, double bound, double limit) {
  const bool held = m.mode->is_held[0];
  const double* margin = reinterpret_cast<const double*>(&m.margin[0]);
  Scan out;
  m.unresolved[0] = UnresolvedRoot();
  const bool clear = m.feet[0].departure == UNDER_WAY && !any_not_below(Row(bound), m.margin[0]);
  if (!clear && find_unresolved(m, 0, margin, bound, limit, m.feet[0].departure, m.unresolved[0])) {
    out.unresolved = true;
    out.interval = m.unresolved[0].first;
    out.far = m.nodes.tau[m.unresolved[0].last];
  }
  out.coarse = m.settings.track && !held && hides_peak(m, 0, bound, limit);
  return out;
}

template <class S>
TARSUS_INLINE Scan scan_one(Modal& m, const StepClass& step, double limit) {
  double bound = chord_bound<S>(m, step, 0, [&m](int p) { return block_speeds<S>(m, p); });
  if (!m.mode->is_held[0]) {
    m.margin[0] = m.outputs[0];
  } else if (!m.steady) {
    bound += bulge_of_inputs(m, step, 0, limit, lowest(m.margin[0]) - bound);
  }
  return scan_bounded(m, bound, limit);
}

}  // namespace tarsus::modal
