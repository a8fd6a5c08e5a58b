// A legged robot as data: a rigid body on legs, each a foot on a spring and damper in two directions.
//
// Direction 0 is upward, 1 along the way. A foot with displacement u [m], hip at a and film momentum P moves by
//
//   u' = w + P/m,   w' = (-k u - c w + Q)/m - c P/m^2,   Q = k a + c a' + load,
//
// so w = u' - P/m [m/s] stays smooth where a film changes P fast. Legs of equal mass, stiffness and damping are of one
// kind and share tables.
#pragma once
#include <vector>

#include "nodes.hpp"

namespace tarsus {

enum Direction { UP, ALONG, DIRECTIONS };

constexpr int MOST_COORDINATES = 6;  // of a rigid body

// How a hip follows the body's coordinates; those that do not move it are left out.
struct Hip {
  int count = 0, at[MOST_COORDINATES];
  double by[MOST_COORDINATES];

  double motion(const double* body) const {
    double out = 0.0;
    for (int n = 0; n < count; n++) out += by[n] * body[at[n]];
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

struct Leg {
  double mass, weight, gap;                                // [kg], [N], clearance at rest [m]
  double stiffness[DIRECTIONS], damping[DIRECTIONS];       // [N/m], [N s/m]
  int kind[DIRECTIONS], foot = -1, first = 0, last = 0;    // tables; foot or -1; drives that act on the foot
  Hip hip[DIRECTIONS];
};

struct Body {
  std::vector<double> mass, weight, lever;  // per coordinate: inertia, weight, largest hip entry
  std::vector<Leg> legs;
  std::vector<int> leg;                     // of a foot
  std::vector<int> drive;                   // of every load on a foot, and its gain upward and along
  std::vector<double> gain;
  std::vector<double> load;                 // (drives, coordinates): loads on the body itself
  int drives = 0;

  int coordinates() const { return int(mass.size()); }
  int feet() const { return int(leg.size()); }
};

// The exact motion of one kind of leg over a step of one length.
struct alignas(64) LegStep {
  double state[4][N];               // at the nodes: u of u0, u of w0, w of u0, w of w0
  double force[2][N][N];            // u and w at the nodes (last index) of a force at one node
  double film[2][N][N];             // the same of a film's momentum
  double force_end[2][N];           // the same at the end of the step alone
  double film_end[2][N];
  double reach_force, reach_film;   // largest |u| under a constant one
};

struct LegTables {
  std::vector<double> lengths;     // [s], falling
  std::vector<double> rate;        // [1/s] of the fastest motion of every kind
  std::vector<int> longest;        // first class whose nodes see the kind's own oscillation
  std::vector<LegStep> steps;      // (lengths, kinds)

  int classes() const { return int(lengths.size()); }
  const LegStep& of(int k, int kind) const { return steps[size_t(k) * rate.size() + kind]; }
};

}  // namespace tarsus
