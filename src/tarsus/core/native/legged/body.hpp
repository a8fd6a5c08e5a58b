// A legged robot as data: a body on legs, each a foot on a spring and damper in two directions, or in three. Of the body's coordinates
// six are rigid motions at most; the others are its modes, payloads on springs and the masses of legs above a compliant tip.
//
// Direction 0 is upward, 1 along the way, 2 across it, to the left. The directions are the body's, and turn with it (docs/bodies.md). A foot with displacement u [m], hip at a and film momentum P moves
// by
//
//   u' = w + P/m,   w' = (-k u - c w + Q)/m - c P/m^2,   Q = k a + c a' + load,
//
// so w = u' - P/m [m/s] stays smooth where a film changes P fast. A constant in P changes w by a constant and nothing else. P is
// therefore counted from the start of each step: a small motion in a strong film would otherwise be a difference of large numbers.
// Legs of equal mass, stiffness and damping are of one kind and share tables.
#pragma once
#include <cmath>
#include <cstdint>
#include <vector>

#include "base/nodes.hpp"

namespace tarsus::legged {

enum Direction { UP, ALONG, ACROSS };
constexpr int DIRECTIONS = 2, MOST_DIRECTIONS = 3;  // of a robot that keeps its heading, and of one that turns or sways

constexpr int MOST_COORDINATES = 16;  // of a body: six rigid motions, and what moves in it on springs

// How a hip follows the body's coordinates; those that do not move it are excluded.
struct Hip {
  int count = 0, at[MOST_COORDINATES];
  double by[MOST_COORDINATES];

  double motion(const double* body) const {
    double out = 0.0;
    for (int n = 0; n < count; n++) out += by[n] * body[at[n]];
    return out;
  }
  // Sizes of what adds up to it.
  double parts(const double* body) const {
    double out = 0.0;
    for (int n = 0; n < count; n++) out += std::fabs(by[n] * body[at[n]]);
    return out;
  }
  TARSUS_INLINE Row motion(const Row* body) const {
    Row out = count > 0 ? body[at[0]] * by[0] : Row(0.0);
    for (int n = 1; n < count; n++) out += body[at[n]] * by[n];
    return out;
  }
  // What acts on the hip, as it acts on the body.
  template <class Real>
  TARSUS_INLINE void carry(const Real& what, Real* body) const {
    for (int n = 0; n < count; n++) body[at[n]] += what * by[n];
  }
};

// A facet of the ground: where it begins [m], its slope and the stretch of the way along it [m].
struct Facet {
  int64_t number = 0;
  double x = 0.0, z = 0.0, cos = 1.0, sin = 0.0, low = 0.0, high = 0.0;

  bool upright() const { return cos == 0.0; }
  double end(int way) const { return way > 0 ? high : low; }
  // Gap above it, and place along it, of a place of the robot's.
  double gap_of(double along, double up) const { return cos * (up - z) - sin * (along - x); }
  double place_of(double along, double up) const { return cos * (along - x) + sin * (up - z); }
  double height(int way) const { return z + (std::isfinite(end(way)) ? end(way) * sin : 0.0); }
  // What rounding may leave of a place on it [m]: some units in the last place of the largest coordinate.
  double rounding() const { return 2e-15 * (std::fabs(x) + std::fabs(z) + (std::isfinite(high - low) ? high - low : 0.0)); }
};

// One line of the ground along the way: how many points it has, whether it repeats, whether its facets are not alike, and where its
// numbers begin among those of all lines of a run: points (., 2), then of unlike facets patches (. - 1, 3).
struct Line {
  int points = 0;
  bool periodic = false, patched = false;
  size_t first = 0;

  size_t end() const { return first + size_t(2 * points + (patched ? 3 * (points - 1) : 0)); }
};

struct Leg {
  double mass, gap;                                      // [kg], clearance at rest [m]
  double weight[MOST_DIRECTIONS] = {};                            // [N] downward, and backward
  double stiffness[MOST_DIRECTIONS], damping[MOST_DIRECTIONS];    // [N/m], [N s/m]
  int kind[MOST_DIRECTIONS], foot = -1, first = 0, last = 0;      // tables; foot or -1; drives that act on the foot
  int line = 0;                                                   // of uneven ground, along which its foot goes
  Hip hip[MOST_DIRECTIONS];

  // Of uneven ground (legged/profile.hpp). place [m]: of the foot at rest along the facet, which lasts from low to high; normal: of the
  // facet, in the directions the leg lives in; rounding [m]: of the gap. sloping: the facet is not level; turned: the leg lives in its
  // directions, in which stiffness and damping couple them (cross) and are more along it than the leg's tables have.
  double place = 0.0, low = -INF, high = INF, normal[DIRECTIONS] = {1.0, 0.0}, rounding = 0.0;
  double cross_stiffness = 0.0, cross_damping = 0.0, more_stiffness = 0.0, more_damping = 0.0;
  bool sloping = false, turned = false;

  // Whether the gap of the foot depends on where it is along the way.
  bool is_tilted() const { return sloping && !turned; }

  // The ground below a foot, by default level: the clearance [m] of a foot displaced by ``up`` and ``along``, and the displacement of
  // one that stands on the ground.
  template <class Real>
  TARSUS_INLINE Real clearance(const Real& up, const Real& along) const {
    return is_tilted() ? up * normal[UP] + along * normal[ALONG] + gap : up + gap;
  }
  double standing() const { return -gap; }
};

struct Body {
  std::vector<double> mass, weight, lever;  // per coordinate: inertia, weight against it, largest hip entry
  std::vector<double> falls;                // (coordinates, 2): weights against it per unit of gravity, see ``weigh``
  std::vector<double> stiffness, damping;   // (coordinates, coordinates): of springs and dampers within the body
  std::vector<Leg> legs;
  std::vector<int> leg;    // of a foot
  std::vector<int> drive;  // of every load on a foot, and its gain (directions)
  std::vector<double> gain;
  std::vector<double> load;  // (drives, coordinates): loads on the body itself
  int drives = 0, directions = DIRECTIONS;
  std::vector<Line> lines;  // of uneven ground
  bool patched = false;     // whether facets of one of them are not alike

  // Numbers of the ground's profile of one run.
  size_t shape() const { return lines.empty() ? 0 : lines.back().end(); }

  int coordinates() const { return int(mass.size()); }
  // Of body and legs; in a state places across come after all others.
  int all_coordinates() const { return coordinates() + directions * int(legs.size()); }
  int coordinate(int leg, int d) const { return coordinates() + (d == ACROSS ? DIRECTIONS * int(legs.size()) + leg : DIRECTIONS * leg + 1 - d); }
  int feet() const { return int(leg.size()); }

  // Take the weights of ``unit``, which are those per unit of gravity, under this one [m/s^2]: into the ground, and back along the
  // way.
  void weigh(const Body& unit, const double* gravity) {
    for (int b = 0; b < coordinates(); b++) weight[b] = gravity[UP] * unit.falls[DIRECTIONS * b] + gravity[ALONG] * unit.falls[DIRECTIONS * b + ALONG];
    for (size_t i = 0; i < legs.size(); i++) {
      for (int d = 0; d < DIRECTIONS; d++) legs[i].weight[d] = gravity[d] * unit.legs[i].weight[d];
    }
  }
};

}  // namespace tarsus::legged
