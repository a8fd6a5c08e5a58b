// A legged robot in motion: what a run carries on from step to step, and the rows of the step being made.
#pragma once
#include <array>
#include <map>
#include <memory>
#include <type_traits>

#include "laws/laws.hpp"
#include "legged/body.hpp"
#include "legged/tables.hpp"
#include "march/grip.hpp"
#include "march/log.hpp"
#include "march/march.hpp"
#include "drives/signals.hpp"
#include "march/friction.hpp"

namespace tarsus::legged {

// How a foot starts a step: as its state says; with a gap of exactly zero, having just left the ground; or with a slip speed of exactly
// zero, having just begun to slide.
enum Launch { AS_IT_COMES, JUST_LEFT, JUST_SLIDING };

// State and history of a foot.
struct LeggedFoot : Grip {
  double u[MOST_DIRECTIONS], w[MOST_DIRECTIONS];  // displacement [m], rate without the film's momentum [m/s]
  double sense[MOST_DIRECTIONS];                  // of sliding along and across, of length 1, 0 without friction
  double slipped;                                 // path slid in contact [m]
  double from, base;                              // gap [m] at which the film's momentum counts as 0, and what it is there [N s]
  Apex apex;
  Contact contact;
  int start;
  bool film, force;  // laws that act on it in the air
  Facet ground;      // below it, of uneven ground
  int wedged = 0;    // +-1: it stands in the corner at that end of its facet, pressed against the next one too

  bool held(int d) const { return contact == STUCK || (contact == SLIPPING && d == UP); }
  bool just_slides() const { return start == JUST_SLIDING; }
  bool slides_with_friction() const { return contact == SLIPPING && (sense[ALONG] != 0.0 || sense[ACROSS] != 0.0); }
  // Go on along the ground: held, or with a sense, from a speed of exactly zero where it ``begins``.
  void set_sliding(bool slips, double along, double across, bool begins) {
    sense[ALONG] = along;
    sense[ACROSS] = across;
    start = begins ? JUST_SLIDING : AS_IT_COMES;
    contact = slips ? SLIPPING : STUCK;
  }
  bool filmed() const { return film && contact == AIR; }
};

// A leg at the nodes of the step: drive and weight, all forces but the film's, motion; then the forces at its foot.
struct LegRows {
  Row load[MOST_DIRECTIONS], q[MOST_DIRECTIONS], u[MOST_DIRECTIONS], w[MOST_DIRECTIONS];
  Row film, gap, rate;                                 // in the air: momentum [N s], gap [m] and its rate
  Row smooth;                                          // force [N] in the air; held, strength less smooth force
  Row strength, margin;                                // held: f_a, N + f_a [N]
  Row bound, force[MOST_DIRECTIONS];                   // most friction, and what it has to bear along and across the way [N]
  Row speed, way[MOST_DIRECTIONS];                     // of one that slides any way: its speed [m/s], and the direction of that
  bool stiff;                                          // whether the film in the air is too stiff for repetition
};

// The body at the nodes of the step, by coordinate.
struct BodyRows {
  Row x[MOST_COORDINATES], v[MOST_COORDINATES];
  Row push[MOST_COORDINATES], drag[MOST_COORDINATES];       // forces, and what damps, by its integral
  Row momentum[MOST_COORDINATES], place[MOST_COORDINATES];  // of the free feet, and its integral but for that of
  Row film[MOST_COORDINATES];                               // the films' momentum
};

// The sum of all feet's forces on the body, and of the springs and dampers within it. Held feet push and drag it through spring and damper: push = offset - stiffness x,
// drag = - damping (x - x(0)); those that nothing holds in a direction follow with their mass.
struct Coupling {
  double stiffness[MOST_COORDINATES][MOST_COORDINATES], damping[MOST_COORDINATES][MOST_COORDINATES];
  double mass[MOST_DIRECTIONS][MOST_COORDINATES][MOST_COORDINATES];
  double offset[MOST_COORDINATES];
};

// The solvers of Projection for steps of one class: inverses for each coordinate alone, and which coordinates the legs link to
// others.
struct Solvers {
  std::vector<std::array<Row, N>> inverse;
  std::vector<uint8_t> linked;
};
// Of all classes, each made when first needed. They depend on the contacts alone, and a robot of few legs returns to the same
// contacts again and again: MOST_CONTACT_SETS sets of solvers are kept.
typedef std::vector<std::shared_ptr<const Solvers>> SolversByClass;
constexpr size_t MOST_CONTACT_SETS = 64;

// Share of a step's tolerance at which its repetition has converged. On 30 random walkers, against a run a thousand
// times as exact, events err by 3e-11 rad in the median (5e-12 with 1e-3, the worst alike) and accounts open by 1e-13,
// at worst 7e-11.
constexpr double CONVERGED = 1e-2;
constexpr int GUESSED = 5;  // powers of time by which the motion of a step is extrapolated into the next one

// Work [J] done on the robot by its drives and weight, and by dampers, films, smooth forces and friction.
struct Energies {
  double work, damping, film, smooth, friction;
};
constexpr int ENERGIES = sizeof(Energies) / sizeof(double);

// Constant matrices that legs need in addition to those of the nodes.
struct Between {
  static constexpr int LINES = 3;
  double powers[N][N];         // [j]: coefficients of powers of s of the Lagrange polynomial of node j
  double about[N][N][N];       // [node][j]: the same about a node
  double slope[N][N];          // [j]: its derivative at the nodes
  double weights[N];           // its integral over the step
  double dense[N][LINES * N];  // [j]: its values at three places between neighbouring nodes
  double places[LINES * N];

  explicit Between(const Nodes& nodes) {
    double binomial[N][N] = {};
    for (int n = 0; n < N; n++) {
      binomial[n][0] = 1.0;
      for (int k = 1; k <= n; k++)
        binomial[n][k] = binomial[n - 1][k - 1] + (k < n ? binomial[n - 1][k] : 0.0);
    }
    for (int j = 0; j < N; j++) {
      weights[j] = nodes.once[j][N - 1];
      for (int c = 0; c < N; c++) {
        powers[j][c] = nodes.monomial[c][j];
        slope[j][c] = nodes.derivative[c][j];
      }
    }
    for (int node = 0; node < N; node++) {
      for (int j = 0; j < N; j++) {
        for (int k = 0; k < N; k++) {
          double sum = 0.0, power = 1.0;
          for (int c = k; c < N; c++, power *= nodes.tau[node])
            sum += binomial[c][k] * power * nodes.monomial[c][j];
          about[node][j][k] = sum;
        }
      }
    }
    for (int p = 0; p < LINES * N; p++) {
      const int j = p / 3;
      const double share[3] = {0.2, 0.5, 0.8};
      const bool inside = j < N - 1;
      places[p] = inside ? nodes.tau[j] + (nodes.tau[j + 1] - nodes.tau[j]) * share[p % 3] : 1.0;
      for (int l = 0; l < N; l++) {
        double value = 1.0;
        for (int k = 0; k < N; k++) {
          if (k != l) value *= (places[p] - nodes.tau[k]) / (nodes.tau[l] - nodes.tau[k]);
        }
        dense[l][p] = value;
      }
    }
  }
};


// The laws on ground whose facets are not alike.
struct PatchedLaws : ActingLaws {
  std::vector<Patch> patches;  // of every foot; none where all are 1

  using ActingLaws::ActingLaws;
  double rebound(int foot, double speed) const {
    const double out = ActingLaws::rebound(foot, speed);
    return patches.empty() ? out : out * patches[foot].rebound;
  }
  template <class Real>
  Real strength(int foot, const Real& age, const Real& volts) const {
    const Real out = ActingLaws::strength(foot, age, volts);
    return patches.empty() ? out : out * patches[foot].strength;
  }
  template <class Real>
  Real friction(int foot, const Real& margin, const Real& held, const Real& speed) const {
    const Real out = ActingLaws::friction(foot, margin, held, speed);
    return patches.empty() ? out : out * patches[foot].friction;
  }
  bool has_friction_at(int foot, double speed = 0.0) const { return (patches.empty() || patches[foot].friction > 0.0) && has_friction(*this, foot, speed); }
};

struct Profile;

struct Legged {
  Body body;  // with the gaps and weights of the run
  const LegTables& tables;
  const Nodes& nodes;
  const Between& between;
  const Settings& units;  // tolerances for a length and a force of one
  Settings settings;      // and those of the run
  PatchedLaws laws;
  Player player;
  Clock clock;
  Log& log;

  // carried on
  double x[MOST_COORDINATES], v[MOST_COORDINATES];
  std::vector<LeggedFoot> feet;            // of every leg, also of one that has no foot to touch the ground with
  double lowest_body, highest_body;  // since the last mark [m]
  Energies energy;
  std::vector<double> shares;        // work [J] of single laws, see ActingLaws::shares
  int step_class = 0, launch_class[AVERAGED_CONTACT + 1] = {}, launched = 0;  // by the kind of event, 0 for a kink
  bool launching = false;

  // of uneven ground: its lines (profile_of), or null, and legs and gains in the robot's own directions
  const Profile* profile = nullptr;
  std::vector<Leg> level;
  std::vector<double> level_gain;

  // the step being made
  std::vector<Row> channels;
  std::vector<LegRows> rows;
  BodyRows at;
  double length = 0.0, origin = 0.0;  // of the step that the rows are of [s], 0 for none; scaled time of the present in it
  Coupling coupling;
  std::map<std::vector<bool>, SolversByClass> kept_solvers;  // by what is held, of every leg in every direction
  SolversByClass* solvers = nullptr;                         // of the present contacts

  Legged(const Body& b, const LegTables& t, const Nodes& n, const Between& f, const Signals& s, const Laws& l,
         const Settings& set, Log& events, size_t driven)
      : body(b), tables(t), nodes(n), between(f), units(set), settings(set), laws(l), player(s, n, driven), log(events),
        feet(b.legs.size()), shares(laws.shares()), channels(driven + 1), rows(b.legs.size()) {}

  int coordinates() const { return body.coordinates(); }
  int legs() const { return int(feet.size()); }
  int directions() const { return body.directions; }
  // Whether a foot slides with friction in two directions, against its velocity in both (legged/slip.hpp).
  bool any_way(int i) const { return directions() > DIRECTIONS && feet[i].slides_with_friction(); }

  // Momentum [N s] of the film under a foot at a gap, from that at its base on.
  template <class Real>
  TARSUS_INLINE Real film(int i, const Real& gap) const {
    return laws.momentum_from(body.legs[i].foot, feet[i].from, feet[i].base, gap);
  }
  double gap_now(int i) const { return body.legs[i].clearance(feet[i].u[UP], feet[i].u[ALONG]); }
  void base_at(int i, double gap) {
    feet[i].from = gap;
    feet[i].base = laws.momentum(body.legs[i].foot, gap);
  }
  // Count the momentum of the film under every foot in the air from the present gap on.
  void rebase() {
    for (int i : body.leg) rebase(i);
  }
  void rebase(int i) {
    LeggedFoot& foot = feet[i];
    if (!foot.filmed()) return;
    const double gap = gap_now(i);
    const double momentum = film(i, gap);
    foot.w[UP] += film_share(i, UP) * momentum / body.legs[i].mass;
    if (body.legs[i].is_tilted()) foot.w[ALONG] += film_share(i, ALONG) * momentum / body.legs[i].mass;
    base_at(i, gap);
  }
  // What a force along the facet's normal does in a direction, and the momentum of the film: 0 for none.
  double normal_share(int i, int d) const {
    const Leg& leg = body.legs[i];
    return leg.is_tilted() ? leg.normal[d] : d == UP ? 1.0 : 0.0;
  }
  double film_share(int i, int d) const { return feet[i].filmed() ? normal_share(i, d) : 0.0; }

  // Whether a film acts in a direction, and its momentum there at the nodes.
  bool films(int i, int d) const { return film_share(i, d) != 0.0; }
  Row film_row(int i, int d) const { return rows[i].film * film_share(i, d); }

  // Volts at a foot's electrode at the nodes, and now.
  const Row& volts(int f) const {
    const int64_t c = laws.laws.volts[f];
    return channels[c < 0 ? channels.size() - 1 : size_t(c)];
  }
  double volts_now(int f) const {
    const int64_t c = laws.laws.volts[f];
    return c < 0 ? 0.0 : player.value(int(c), clock.time);
  }

  Row powers(const Row& values) const { return combine(&between.powers[0][0], values); }
  double polynomial_at(const Row& values, double s) const {
    double line[N];
    store(line, powers(values));
    return horner(line, 0, N, s);
  }
};

// Call ``each`` with every direction of the robot's legs from FIRST on, constants to the compiler, which the third costs one question
// of a robot that has none.
template <int FIRST, class Each>
TARSUS_INLINE void in_directions(const Legged& s, Each&& each) {
  if (FIRST == UP) each(std::integral_constant<int, UP>());
  each(std::integral_constant<int, ALONG>());
  if (s.directions() > DIRECTIONS) each(std::integral_constant<int, ACROSS>());
}

// Bound [N] below which the pull on a foot on the ground counts as zero: by the scale of the scene, or its rounding.
inline double no_pull(const Legged& s, int i) {
  const Leg& leg = s.body.legs[i];
  double parts = leg.stiffness[UP] * (leg.hip[UP].parts(s.x) + std::fabs(leg.standing())) + leg.damping[UP] * leg.hip[UP].parts(s.v) + std::fabs(leg.weight[UP]);
  for (int n = leg.first; n < leg.last; n++) {
    parts += std::fabs(s.body.gain[s.directions() * n + UP] * s.player.value(s.body.drive[n], s.clock.time));
  }
  if (leg.turned) {
    parts += std::fabs(leg.cross_stiffness) * (leg.hip[ALONG].parts(s.x) + std::fabs(s.feet[i].u[ALONG])) +
             std::fabs(leg.cross_damping) * (leg.hip[ALONG].parts(s.v) + std::fabs(s.feet[i].w[ALONG]));
  }
  if (s.feet[i].force) parts += std::fabs(s.laws.force(leg.foot, 0.0, 0.0, s.volts_now(leg.foot), s.clock.time));
  return s.settings.force_zero + ROUNDING * parts;
}

}  // namespace tarsus::legged
