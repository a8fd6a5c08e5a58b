// Whether a foot that lands bounces, is captured or rests, and the energy of an impact: once for every system.
#pragma once
#include "laws/laws.hpp"
#include "march/log.hpp"

namespace tarsus {

// A foot at the ground that approaches it. speed [m/s]: of approach; after [m/s]: of departure; pull [N] of the structure on
// the foot stopped there, smooth forces included; strength [N] of the new contact; printed [N]: pull by (2.13) as printed,
// where that is the rule; mobility [1/kg] of the foot along its normal; none [N]: bound below which the pull on a
// foot without speed after the impact counts as zero.
struct Landing {
  double speed, after, pull, strength, printed, mobility, none;

  double lost() const { return 0.5 / mobility * (speed * speed - after * after); }  // [J] by restitution
  double kept() const { return 0.5 / mobility * after * after; }                    // [J] after it, which adhesion takes in a capture
};

// Ratio of the speeds after and before an impact above which a foot takes more than a thousand flights to come to rest: the force
// that presses it down may change meanwhile, so that the series of the flights does not determine when it rests. The bound differs
// from 1 by a power of two, which no coefficient does by chance.
constexpr double HARDLY_LESS = 1.0 - 1.0 / 1024.0;

// BOUNCE, CAPTURE, REST or AVERAGED_CONTACT; height [m] below which a flight is none.
inline EventKind landing_kind(const ActingLaws& laws, int foot, const Landing& at, double height) {
  // the foot is pressed down, and all its remaining flights are lower than that height
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

// Part of a force or speed within which a decision is in doubt: a run itself determines them to some 1e-9.
constexpr double CLOSE = 1e-7;

inline bool is_close(double a, double b) {
  return std::fabs(a - b) < CLOSE * (std::fabs(a) + std::fabs(b));
}

// Time [s] at which the remaining flights of a foot that comes to rest are over, a geometric series under its pull.
inline double rest_time(double t, const Landing& at) {
  return t - 2.0 * at.after / (at.pull * at.mobility) / (1.0 - at.after / at.speed);
}

// What is reported of an impact at a time that takes an energy [J].
inline EventNumbers numbers_of(const ActingLaws& laws, int foot, EventKind kind, double t, const Landing& at, double energy) {
  EventNumbers out;
  out.when = kind == REST ? rest_time(t, at) : t;
  out.before = at.speed;
  if (kind == BOUNCE) out.after = at.after;
  out.pull = at.pull;
  out.strength = at.strength;
  out.energy = energy;
  if (kind == CAPTURE && laws.has(foot, HAS_LATCH)) out.adhesion = at.kept();
  return out;
}

// Angle [rad] in [0, pi/2] of the passive projection of an impact law that throws e and skews: Newton's method,
// bracketed.
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
