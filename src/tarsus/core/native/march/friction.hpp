// Friction along the ground, once for every system: its bound under a foot that slides, which way and whether one slides, and what
// an impact takes of its speed along the ground.
//
// A foot on the ground sticks, held along the ground where it is, or slides with the friction F = -sense * bound(N + f_a, f_a, |v|)
// [N] of the law.
#pragma once
#include "base/nodes.hpp"
#include "march/rules.hpp"
#include "march/together.hpp"

namespace tarsus {

// Most powers of e by which friction that falls with the speed may drive a foot from its motion within a step. An implicit step
// of an unstable motion is right as long as its own growth is some e; far longer ones find a motion of the other sign.
constexpr double MOST_GROWTH = 1.0;

// Whether a step is short enough for that. damping [N s/m]: of what else acts on the foot; mobility [m/s per N]: the rate to
// which a constant force along the ground brings the foot by the end of the step, at most.
inline bool follows_growth(const Row& by_speed, double damping, double mobility) {
  return (-lowest(by_speed) - damping) * mobility <= MOST_GROWTH;
}

// Which way a foot slides that moves, or is pulled, along the ground.
inline double sense_of_slip(double along) { return along > 0.0 ? 1.0 : -1.0; }

// Whether the law lets friction act on a foot at all, at rest or at a slip speed [m/s].
inline bool has_friction(const ActingLaws& laws, int foot, double speed = 0.0) {
  return laws.friction(foot, 1.0, 1.0, 0.0) != 0.0 || laws.friction(foot, 1.0, 1.0, speed) != 0.0;
}

// How a foot put on the ground with a rate [m/s] along it goes on; none [m/s]: a rate that is none. Without friction it slides with
// no sense.
struct Footing {
  bool sticks;
  double sense;

  Footing(bool friction, double rate, double none)
      : sticks(friction && std::fabs(rate) <= none), sense(!friction || sticks ? 0.0 : sense_of_slip(rate)) {}
};

// Of a foot that sticks, at one moment [N]: its margin, what friction has to bear along the ground, and what it can.
struct Bearing {
  double margin, along, most;

  template <class AnyLaws>
  Bearing(AnyLaws& laws, int foot, double free, double strength, double pulled)
      : margin(free), along(pulled), most(laws.friction(foot, free, strength, 0.0)) {}

  // ``none`` [N]: what is no force.
  bool holds(double none) const { return std::fabs(along) <= most + none; }
};

// --- at the nodes of a step ------------------------------------------------------------------------------------------------

// A slip speed [m/s] of next to nothing. A law may tell rest from motion, as two constants do: what bears on a foot that slides is
// what it tends to as the speed does to zero.
constexpr double LEAST_SLIP = 1e-300;

// The bound of friction [N] on a foot that slides: at(speed, sign), a Dual at the nodes, at the slip speed, of which ``sign``
// is the derivative by the speed in the sense of the slip. Beyond a stop, where that is negative, the bound is that of its
// mirror image, 2 b(0) - b(-v), so that the nodes of a step in which a slip stops see little of it. Under a foot that
// ``begins`` to slide from rest it stays what it is at rest: friction that falls with the speed would else push it backwards,
// the other motion from an unstable rest. b(0) is the limit of a slip. A slope that is not finite is none.
template <class At>
inline auto mirrored(const Row& speed, bool begins, At&& at) {
  auto out = at(magnitude(speed), each(speed, [](double v) { return v < 0.0 ? -1.0 : 1.0; }));
  if (any_less(speed, Row(LEAST_SLIP))) {
    const auto rest = at(Row(LEAST_SLIP), Row(0.0));
    const auto select = [&](Row& to, const Row& still) {
      for (int j = 0; j < N; j++) {
        if (speed[j] < LEAST_SLIP) to.set(j, begins || speed[j] == 0.0 ? still[j] : 2.0 * still[j] - to[j]);
      }
    };
    select(out.value, rest.value);
    for (size_t p = 0; p < std::size(out.slope); p++) select(out.slope[p], rest.slope[p]);
  }
  for (Row& slope : out.slope) {
    if (!finite(slope)) slope = each(slope, [](double by) { return std::isfinite(by) ? by : 0.0; });
  }
  return out;
}

// Its slopes are by margin, strength and speed, as the arguments of the law (see FrictionArgument).
typedef Dual<FRICTION_ARGUMENTS> SlidingBound;

// As the law has it, at a speed of whose size ``sign`` is the derivative: at 0 that of a foot that sticks.
inline SlidingBound bound_by_law(const ActingLaws& laws, int foot, const Row& margin, const Row& strength, const Row& at, const Row& sign) {
  SlidingBound slip(at);
  slip.slope[SLIP_SPEED] = sign;
  return laws.friction(foot, SlidingBound::variable(margin, MARGIN), SlidingBound::variable(strength, HELD_STRENGTH), slip);
}

// speed [m/s]: in the sense of the slip.
inline SlidingBound sliding_bound(const ActingLaws& laws, int foot, const Row& margin, const Row& strength, const Row& speed, bool begins) {
  const auto by_law = [&](const Row& at, const Row& sign) { return bound_by_law(laws, foot, margin, strength, at, sign); };
  return laws.laws.friction_by_speed ? mirrored(speed, begins, by_law) : by_law(Row(0.0), Row(0.0));
}

// Part of a bound that depends on the slip speed which the nodes may miss in a step, well above its rounding. The bend of the bound
// where a slip stops moves a foot by less than any tolerance, but the moment of the stop depends on it.
constexpr double BEND = 1e-9;
constexpr double AT_ONCE = 1e-12;  // part of a run in which it does not matter when a slip stops

// Scaled time between nodes j - 1 and j at which the polynomial of those coefficients has its least value: its slope rises through
// zero there.
inline double turn_between(const Nodes& nodes, const double* powers, int j) {
  double low = nodes.tau[j - 1], high = nodes.tau[j];
  for (int n = 0; n < 40; n++) {
    const double middle = 0.5 * (low + high);
    (horner_slope(powers, 0, N, middle) < 0.0 ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

// What the nodes of a step of length h [s], of a run that ends at ``end`` [s], miss of the bound over what they may: by its own
// polynomial, and by the law where the slip is slowest between two of them, law(scaled time, speed). A slip that hardly stops is
// seen there alone. rounding [N]: of the margin that bears the bound, of which no shorter step would see less.
template <class Law>
inline double bend_error(const Nodes& nodes, const Row& bound, const Row& speed, double rounding, double h, double end, Law&& law) {
  const double most = highest(magnitude(bound));
  if (!(h > AT_ONCE * end && most > 0.0)) return 0.0;
  double missed = nodes.truncation_of_jumps(bound);
  const Row slope = nodes.slope(speed);
  for (int j = 1; j < N; j++) {
    if (!(slope[j - 1] < 0.0 && 0.0 < slope[j])) continue;
    double speeds[N], bounds[N];
    store(speeds, powers_of(nodes, reinterpret_cast<const double*>(&speed)));
    store(bounds, powers_of(nodes, reinterpret_cast<const double*>(&bound)));
    const double at = turn_between(nodes, speeds, j);
    missed = std::max(missed, std::fabs(law(at, horner(speeds, 0, N, at)) - horner(bounds, 0, N, at)));
  }
  return missed / std::max(BEND * most, rounding);
}

// --- in an impact ----------------------------------------------------------------------------------------------------------

// Rates of a free foot per unit impulse [1/kg]: normal by normal, along the ground by normal and the other way round, along by
// along.
struct Mobilities {
  double normal, across, along;
};

// Friction impulse [N s] along the ground on a foot that an impact throws back, the kinetic energy [J] that it takes beyond what
// restitution takes, and what it leaves of the rate [m/s] along the ground with which restitution begins.
struct Braking {
  double impulse, lost, left;
};

// Of all impulses that Coulomb's law allows, |p_t| <= ratio p_n, the one that leaves the least kinetic energy where the foot
// departs with the speed ``after``. It stops what the foot has along the ground when restitution begins, or brakes that as much
// as it may. So no impact ever adds energy, however the two ways are coupled (Kane's paradox); where they are not, as under a
// point mass, the foot stops or is braked by ratio times the change of its normal rate. Where what is held leaves it no way along
// the ground but with its normal, that slip and its mobility are rounding, and there is no impulse.
inline Braking braking(const Mobilities& by, double speed, double after, double along, double ratio) {
  const double coupling = by.across / by.normal, slip = along + speed * coupling, mobility = by.along - by.across * coupling;
  Braking out{0.0, 0.0, slip};
  const double size = std::fabs(slip);
  if ((size == 0.0 && ratio == 0.0) || !(mobility > NO_PART * by.along)) return out;
  const bool forward = slip > 0.0;
  out.impulse = -slip / mobility;
  out.left = 0.0;
  const double turned = forward ? -ratio : ratio, room = by.normal + turned * by.across;  // p_t = turned p_n
  if (room > 0.0) {
    const double most = turned * (speed + after) / room;
    if (forward ? out.impulse < most : most < out.impulse) {
      out.impulse = most;
      out.left = slip + most * mobility;
    }
  }
  out.lost = -out.impulse * (slip + 0.5 * out.impulse * mobility);
  return out;
}

// By the law: the ratio is what it takes of a push alone, at the slip speed before the impact. Adhesion is a finite
// force, without an impulse in an impact.
template <class AnyLaws>
inline Braking impact_friction(AnyLaws& laws, int foot, const Mobilities& by, double speed, double after, double along) {
  const double change = speed + after;
  return braking(by, speed, after, along, laws.friction(foot, change, 0.0, magnitude(along)) / change);
}

}  // namespace tarsus
