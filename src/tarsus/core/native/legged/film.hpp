// A film too stiff for repetition: the gaps of one foot at the nodes by Newton's method.
#pragma once
#include "base/dense.hpp"
#include "legged/legged.hpp"

namespace tarsus::legged {

constexpr int FILM_ROUNDS = 40;

// A film that moves the gap by more than this part of the change of the gap that causes it, is solved by Newton's method: repetition
// would gain less than a digit a round.
constexpr double STIFF_FILM = 0.1;

// Whether it is so at the least gap of the rows; reach: how far a unit of momentum moves the gap [s/kg].
inline bool is_stiff(const Legged& s, double reach, int f, const Row& gap) {
  const double probe = s.settings.probe, least = lowest(gap);
  const double change = s.laws.momentum(f, least + probe) - s.laws.momentum(f, least);
  return !(std::fabs(change) * reach < STIFF_FILM * probe);
}

// Solve gap = ``alone`` + film matrix P(gap) at the nodes, by rows of what the momentum at one node does, from the gap of the
// rows; the film's momentum there becomes P.
//
// A step of Newton's method uses up half of the way to where a film P ~ 1/(g + g0)^2 is infinite, -2 P/P', at most. False
// where it does not converge.
TARSUS_APART inline bool stiff_film(const Legged& s, const double* film_matrix, int i, const Row& alone, LegRows& r) {
  const int f = s.body.legs[i].foot;
  const double base = s.feet[i].base;
  const double tolerance = CONVERGED * s.settings.gap;
  Row gap = r.gap;
  gap.set(0, alone[0]);
  Row columns[N];
  for (int round = 0; round < FILM_ROUNDS; round++) {
    const Row film = s.film(i, gap), slope = s.laws.momentum_slope(f, gap, s.settings.probe);
    const Row misfit = alone - gap + combine(film_matrix, film);
    const Row far = each(film, slope, [base](double p, double by) { return by < 0.0 ? -2.0 * (p + base) / by : INF; });
    for (int j = 0; j < N; j++) {
      columns[j] = load(film_matrix + N * j) * -slope[j];
      columns[j].set(j, columns[j][j] + 1.0);
    }
    Row step = misfit;
    if (!solve_columns(columns, step)) return false;
    if (!finite(step)) return false;
    const double room = lowest(far), deepest = std::max(-lowest(step), 0.0), largest = highest(magnitude(step));
    const double share = deepest > 0.5 * room ? 0.5 * room / deepest : 1.0;
    gap += step * share;
    if (largest <= tolerance) {
      r.gap = gap;
      r.film = s.film(i, gap);
      return true;
    }
  }
  return false;
}

}  // namespace tarsus::legged
