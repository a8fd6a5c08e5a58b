// A film too stiff for repetition: the gaps of one foot at the nodes by Newton's method.
#pragma once
#include "dense.hpp"
#include "legged.hpp"

namespace tarsus {

constexpr int FILM_ROUNDS = 40;

// Whether the film changes the gap by more than a fraction of what changes the film, where it is thinnest.
inline bool is_stiff(const Legged& s, const LegStep& table, int f, const Row& gap) {
  const double probe = s.settings.probe, least = lowest(gap);
  const double change = s.laws.momentum(f, least + probe) - s.laws.momentum(f, least);
  return !(std::fabs(change) * table.reach_film < 0.1 * probe);
}

// Solve gap = gap without film + film matrix P(gap) at the nodes; the film's momentum becomes P there.
//
// The rows hold the motion without film and where to start. A step of Newton's method uses up half of the way
// to where a film P ~ 1/(g + g0)^2 is infinite, -2 P/P', at most. False where it does not settle.
TARSUS_APART inline bool stiff_film(const Legged& s, const LegStep& table, int i, LegRows& r) {
  const Leg& leg = s.body.legs[i];
  const int f = leg.foot;
  const double tolerance = 1e-3 * s.settings.gap;
  const Row alone = r.u[UP] + leg.gap;
  Row gap = r.gap;
  gap.set(0, alone[0]);
  double matrix[N][2 * N];
  for (int round = 0; round < FILM_ROUNDS; round++) {
    const Row film = s.laws.momentum(f, gap), slope = s.laws.momentum_slope(f, gap, s.settings.probe);
    const Row misfit = alone - gap + combine(&table.film[0][0][0], film);
    double room = INF;
    for (int j = 0; j < N; j++) {
      if (slope[j] < 0.0) room = std::min(room, -2.0 * film[j] / slope[j]);
      for (int n = 0; n < N; n++) matrix[n][j] = (n == j ? 1.0 : 0.0) - table.film[0][j][n] * slope[j];
    }
    for (int n = 0; n < N; n++) matrix[n][N] = misfit[n];
    if (!eliminate(&matrix[0][0], N, 2 * N)) return false;
    double deepest = 0.0, largest = 0.0;
    bool finite = true;
    for (int n = 0; n < N; n++) {
      const double step = matrix[n][N];
      finite = finite && std::isfinite(step);
      deepest = std::max(deepest, -step);
      largest = std::max(largest, std::fabs(step));
    }
    if (!finite) return false;
    const double share = deepest > 0.5 * room ? 0.5 * room / deepest : 1.0;
    for (int n = 0; n < N; n++) gap.set(n, gap[n] + share * matrix[n][N]);
    if (largest <= tolerance) {
      r.gap = gap;
      r.film = s.laws.momentum(f, gap);
      return true;
    }
  }
  return false;
}

}  // namespace tarsus
