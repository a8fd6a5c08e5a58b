// The ground along the way: a polyline of facets, on each of which a gap is linear, and the frame of a foot that stands on one.
//
// A foot on a facet lives in the facet's own directions: UP is its normal n = (-sin a, cos a), ALONG its tangent t = (cos a, sin a) in
// (along, upward), so that what holds for a foot on level ground holds for it. Springs and dampers, which are
// not alike in the two directions of the robot, then couple the facet's directions:
//
//   k_nn = k_v cos^2 a + k_l sin^2 a,  k_tt = k_l cos^2 a + k_v sin^2 a,  k_nt = (k_v - k_l) sin a cos a.
//
// In the air it lives in the robot's directions; there the facet gives its gap. On level facets the two are one.
#pragma once
#include <cstdint>

#include "legged/legged.hpp"

namespace tarsus::legged {

// The facets along a line of a run: its numbers, points [m] along the way and in height, and where they are not alike patches.
// Those of a ground that repeats go on with the last
// point as the first of the next cell; else the ground goes on level beyond both ends.
struct Profile : Line {
  const double* numbers = nullptr;

  // A facet, and its factors of the laws.
  Facet facet(int64_t k) const {
    const int64_t n = points - 1;
    const int64_t cell = periodic ? (k >= 0 ? k / n : -((n - 1 - k) / n)) : 0, j = k - cell * n;
    Facet out;
    out.number = k;
    if (j < 0 || j >= n) {
      const int64_t end = j < 0 ? 0 : 2 * n;
      out.x = numbers[end];
      out.z = numbers[end + 1];
      (j < 0 ? out.low : out.high) = j < 0 ? -INF : INF;
      return out;
    }
    const double dx = numbers[2 * j + 2] - numbers[2 * j], dz = numbers[2 * j + 3] - numbers[2 * j + 1];
    out.x = numbers[2 * j] + double(cell) * (numbers[2 * n] - numbers[0]);
    out.z = numbers[2 * j + 1] + double(cell) * (numbers[2 * n + 1] - numbers[1]);
    out.high = std::hypot(dx, dz);
    out.cos = dx / out.high;
    out.sin = dz / out.high;
    return out;
  }
  Patch patch(int64_t k) const {
    if (!patched) return {};
    const int64_t n = points - 1, j = periodic ? ((k % n) + n) % n : std::min(std::max(k, int64_t(0)), n - 1);
    const int64_t own = 2 * points + 3 * j;
    return {numbers[own], numbers[own + 1], numbers[own + 2]};
  }
  // The facet, not a vertical one, below a place (along, height); at a corner the one that leaves it above the ground.
  Facet below(double x, double z) const {
    const int64_t n = points - 1;
    const double span = numbers[2 * n] - numbers[0];
    const double cell = periodic ? std::floor((x - numbers[0]) / span) : 0.0, at = x - cell * span;
    int64_t low = -1, high = n;
    while (high - low > 1) {
      const int64_t middle = (low + high) / 2;
      (numbers[2 * middle] <= at ? low : high) = middle;
    }
    if (!periodic && high == n && at >= numbers[2 * n]) low = n;
    Facet out = facet(int64_t(cell) * n + low);
    if (out.upright()) out = facet(out.number + 1);
    if (x - out.x <= out.rounding() && z < out.z - out.rounding()) {
      out = facet(out.number - 1);
      if (out.upright()) out = facet(out.number - 1);
    }
    return out;
  }
};

// The line below a foot.
inline const Profile& profile_of(const Legged& s, int i) { return s.profile[s.body.legs[i].line]; }

// The turn from one facet into the next in the direction ``way`` (+-1), by which the ground rises: a corner that rises is concave.
struct Corner {
  double sin, cos;

  Corner(const Facet& from, const Facet& to, int way)
      : sin(double(way) * (from.cos * to.sin - from.sin * to.cos)), cos(from.cos * to.cos + from.sin * to.sin) {}
  // Directions that differ by less than what rounding leaves of them are one: a turn by 1e-12 takes 1e-24 of the energy.
  bool straight() const { return std::fabs(sin) < 1e-12 && cos > 0.0; }
  bool rises() const { return sin > 0.0; }
};

// The corner at an end of the facet of a foot.
inline Corner corner_of(const Legged& s, int i, int way) {
  const Facet& on = s.feet[i].ground;
  return {on, profile_of(s, i).facet(on.number + way), way};
}

inline Hip combined(const Hip& a, double by_a, const Hip& b, double by_b) {
  Hip out;
  const auto add = [&out](const Hip& from, double by) {
    for (int n = 0; n < from.count; n++) {
      int k = 0;
      while (k < out.count && out.at[k] != from.at[n]) k++;
      if (k == out.count) {
        out.at[out.count] = from.at[n];
        out.by[out.count++] = 0.0;
      }
      out.by[k] += by * from.by[n];
    }
  };
  add(a, by_a);
  add(b, by_b);
  return out;
}

// Components (upward, along) of a vector, from the robot's directions into a facet's: of one with the slope's sine reversed, back.
inline void rotate(double* vector, double cos, double sin) {
  const double up = vector[UP], along = vector[ALONG];
  vector[UP] = cos * up - sin * along;
  vector[ALONG] = cos * along + sin * up;
}

// Of springs, or dampers, upward and along the way: what they are in the directions of a facet, and couple of them.
struct Mixed {
  double own[DIRECTIONS], cross;

  Mixed(double up, double along, double c, double s)
      : own{up * c * c + along * s * s, along * c * c + up * s * s}, cross((up - along) * s * c) {}
};

// Set a foot that is in the air above its facet, in the robot's directions.
inline void float_above(Legged& s, int i) {
  Leg& leg = s.body.legs[i];
  const Leg& level = s.level[i];
  const Facet& on = s.feet[i].ground;
  leg = level;
  for (int n = leg.first; n < leg.last; n++) {
    for (int d = 0; d < DIRECTIONS; d++) s.body.gain[2 * n + d] = s.level_gain[2 * n + d];
  }
  leg.gap = on.gap_of(level.place, level.gap);
  leg.place = level.place - on.x;
  leg.normal[UP] = on.cos;
  leg.normal[ALONG] = -on.sin;
  leg.sloping = on.sin != 0.0;
  // A film on one side of a corner alone may drive a foot off that side while its leg, or the film of the other side, drives it back.
  // So it is above its facet for as much longer as flights may be high that are none, and cannot cross the corner again in no time; but
  // for the side of a step, which stops it.
  const bool reacts = s.feet[i].film || s.feet[i].force;
  const auto past = [&](int way) {
    const bool stops = (on.upright() || profile_of(s, i).facet(on.number + way).upright()) && corner_of(s, i, way).rises();
    return reacts && !stops ? s.settings.rest_height : 0.0;
  };
  leg.low = on.low * on.cos - past(-1);
  leg.high = on.high * on.cos + past(1);
  leg.rounding = on.rounding();
  if (s.body.patched) s.laws.patches[leg.foot] = profile_of(s, i).patch(on.number);
}

// The numbers of a leg whose foot is above its facet, in the facet's directions.
inline void turn_leg(Legged& s, int i) {
  Leg& leg = s.body.legs[i];
  if (!leg.sloping) return;
  LeggedFoot& foot = s.feet[i];
  const Leg& level = s.level[i];
  const double c = foot.ground.cos, z = foot.ground.sin;
  rotate(leg.weight, c, z);
  for (int n = leg.first; n < leg.last; n++) rotate(&s.body.gain[2 * n], c, z);
  leg.hip[UP] = combined(level.hip[UP], c, level.hip[ALONG], -z);
  leg.hip[ALONG] = combined(level.hip[ALONG], c, level.hip[UP], z);
  const auto mix = [c, z](double* of, const double* level) {
    const Mixed found(level[UP], level[ALONG], c, z);
    std::copy_n(found.own, DIRECTIONS, of);
    return found.cross;
  };
  leg.cross_stiffness = mix(leg.stiffness, level.stiffness);
  leg.cross_damping = mix(leg.damping, level.damping);
  leg.more_stiffness = leg.stiffness[ALONG] - level.stiffness[ALONG];
  leg.more_damping = leg.damping[ALONG] - level.damping[ALONG];
  leg.place = foot.ground.place_of(level.place, level.gap);
  leg.low = foot.ground.low;
  leg.high = foot.ground.high;
  leg.turned = true;
}

// Go over to the facet's directions, with the rates of the foot itself, and back.
inline void turn(Legged& s, int i) {
  if (!s.body.legs[i].sloping || s.body.legs[i].turned) return;
  s.rebase(i);
  rotate(s.feet[i].u, s.feet[i].ground.cos, s.feet[i].ground.sin);
  rotate(s.feet[i].w, s.feet[i].ground.cos, s.feet[i].ground.sin);
  turn_leg(s, i);
}
inline void turn_back(Legged& s, int i) {
  if (!s.body.legs[i].turned) return;
  LeggedFoot& foot = s.feet[i];
  rotate(foot.u, foot.ground.cos, -foot.ground.sin);
  rotate(foot.w, foot.ground.cos, -foot.ground.sin);
  float_above(s, i);
}

// A foot in the air is above another facet from now on. The films of the two differ, so it goes on with its own rate.
inline void pass_over(Legged& s, int i, const Facet& to) {
  LeggedFoot& foot = s.feet[i];
  foot.ground = to;
  float_above(s, i);
  if (foot.film) s.base_at(i, s.gap_now(i));
}

// Where a facet ends for a foot on it or above it.
inline double end_of(const Legged& s, int i, int way) {
  if (s.feet[i].contact != AIR) return s.feet[i].ground.end(way);
  return way > 0 ? s.body.legs[i].high : s.body.legs[i].low;
}

// Displacement and rate of a foot in the robot's directions, as it is or as given in those it lives in.
inline void in_world(const Legged& s, int i, double* vector) {
  if (s.body.legs[i].turned) rotate(vector, s.feet[i].ground.cos, -s.feet[i].ground.sin);
}

// Put the feet of a run that begins above its ground.
inline void lay_ground(Legged& s) {
  s.level = s.body.legs;
  s.level_gain = s.body.gain;
  for (int i : s.body.leg) {
    const double* u = s.feet[i].u;
    s.feet[i].ground = profile_of(s, i).below(u[ALONG] + s.level[i].place, u[UP] + s.level[i].gap);
    float_above(s, i);
  }
}

}  // namespace tarsus::legged
