// Whether a foot that lands bounces, is captured or rests: the one decision, for every system.
#pragma once
#include "march/kinds.hpp"
#include "laws/laws.hpp"

namespace tarsus {

// A foot at the ground that approaches it. speed [m/s] of approach; after [m/s] of departure; pull [N] of the structure on
// the foot stopped there, smooth forces included; strength [N] of the new contact; printed [N]: pull by (2.13) as printed,
// where that is the rule; mobility [1/kg] of the foot along its normal; none [N]: pull that is none, of one that departs with
// no speed.
struct Landing {
  double speed, after, pull, strength, printed, mobility, none;

  double lost() const { return 0.5 / mobility * (speed * speed - after * after); }  // [J] by restitution
  double kept() const { return 0.5 / mobility * after * after; }                    // [J] that departs, or adhesion takes
};

// Share of its speed that an impact leaves, above which flights take more than a thousand of their own to come to rest: what
// presses them may change meanwhile, so that no series tells when. A power of two, which no coefficient is by chance.
constexpr double HARDLY_LESS = 1.0 - 1.0 / 1024.0;

// BOUNCE, CAPTURE, REST or AVERAGED_CONTACT; height [m] below which a flight is none.
inline EventKind landing_kind(const ActingLaws& laws, int foot, const Landing& at, double height) {
  // it is pressed down, and all flights that are left are lower than that
  const bool stopped = at.after == 0.0 && at.pull <= at.none;
  bool low = stopped || (at.pull < 0.0 && at.after * at.after < -2.0 * at.pull * at.mobility * height);
  bool held;
  if (laws.has(foot, RESTITUTES_FIRST)) {
    held = at.pull <= at.strength && laws.excess(foot, at.after) <= 0.0;
  } else if (laws.has(foot, PULL_AS_PRINTED)) {
    held = at.printed <= std::max(at.strength, 0.0);
  } else {
    held = laws.has(foot, HAS_LATCH) && at.pull <= at.strength;
    low = low && !laws.has(foot, HAS_LATCH);
  }
  if (held || (low && stopped)) return CAPTURE;
  if (!low) return BOUNCE;
  return at.after <= HARDLY_LESS * at.speed ? REST : AVERAGED_CONTACT;
}

// Time [s] at which a foot that comes to rest has made its flights, a geometric series under its pull.
inline double rest_time(double t, const Landing& at) {
  return t - 2.0 * at.after / (at.pull * at.mobility) / (1.0 - at.after / at.speed);
}

// Coulomb friction of an impact that changes the normal velocity by ``change`` [m/s]: it brakes the velocity ``along`` the
// ground by mu times as much at most, mu being that of the slip speed before the impact. What adhesion adds is a force, which
// brakes nothing in no time. Returns the kinetic energy [J] that takes.
inline double impact_friction(const ActingLaws& laws, int foot, double mass, double change, double& along) {
  const double before = along, most = laws.friction(foot, change, 0.0, std::fabs(along));
  along = before > 0.0 ? std::max(before - most, 0.0) : std::min(before + most, 0.0);
  return 0.5 * mass * (before * before - along * along);
}

// Angle [rad] in [0, pi/2] of the passive projection of an impact map that throws e and skews: Newton's method, bracketed.
inline double passive_angle(double e, double skew) {
  if (e >= 1.0) return 0.0;
  const double wanted = (1.0 + e) * skew * std::sqrt(1.0 - e * e);
  double low = 0.0, high = 2.0 * std::atan(1.0), theta = std::atan2(wanted, 1.0 - e * e);
  for (int n = 0; n < 60; n++) {
    const double sine = std::sin(theta), cosine = std::cos(theta);
    const double f = sine * (1.0 - e * e * cosine) - wanted * cosine;
    (f > 0.0 ? high : low) = theta;
    const double slope = cosine * (1.0 - e * e * cosine) + e * e * sine * sine + wanted * sine;
    double after = slope > 0.0 ? theta - f / slope : low;
    if (!(low <= after && after <= high)) after = 0.5 * (low + high);
    if (std::fabs(after - theta) <= 1e-16) return after;
    theta = after;
  }
  return theta;
}

}  // namespace tarsus
