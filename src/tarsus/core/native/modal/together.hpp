// Feet that land at one moment: one impact of all of them (see march/together.hpp), so that it does not matter which comes first.
//
// Each foot keeps its own law: its rebound, whether it is held, its friction, its direction of the structure. What the structure does beyond
// the mass-weighted map is in the plane of the normal motion that the impact changes and of the feet's directions across it,
// where it is the map of one foot (`follow_across`).
#pragma once
#include <numeric>

#include "march/brake.hpp"
#include "modal/holds.hpp"

namespace tarsus::modal {

// One of them. target [m/s]: the rate with which it departs, 0 of one that is held; impulse, braked [N s]: on it, along
// the normal and along the ground. Others may throw it off the ground: it then has no impulse, and no event.
struct Struck {
  int foot;
  Landing at;
  double target, impulse = 0.0, braked = 0.0;
  EventKind kind = BOUNCE;

  bool hit() const { return impulse > 0.0; }
};

// Rates [m/s] that unit impulses make: normal by normal ones; normal (row) by those along the ground; along by along; and the rates along
// the ground before the impact.
struct Coupled {
  Square normal, by_along, along;
  std::vector<double> slip;

  Coupled(const Modal& m, const std::vector<Struck>& feet) : normal(int(feet.size())), by_along(normal.size), along(normal.size), slip(feet.size(), 0.0) {
    const ContactMode& mode = *m.mode;
    const size_t state = m.sizes.state();
    const auto rate = [&](const double* row, const double* by) {
      double sum = 0.0;
      for (size_t k = 0; k < state; k++) sum += row[k] * by[k];
      return sum;
    };
    for (int i = 0; i < normal.size; i++) {
      const double* row = mode.outputs + (m.sizes.feet + feet[i].foot) * state;
      const bool frictional = m.frictional[feet[i].foot];
      if (frictional) slip[i] = m.along(m.mode->slide_rate, feet[i].foot);
      for (int j = 0; j < normal.size; j++) {
        const size_t other = feet[j].foot * state;
        normal.at(i, j) = rate(row, mode.beta + other);
        if (!m.frictional[feet[j].foot]) continue;
        by_along.at(i, j) = rate(row, mode.slide + other);
        if (frictional) along.at(i, j) = rate(mode.slide_rate + feet[i].foot * state, mode.slide + other);
      }
    }
    for (int i = 0; i < normal.size; i++) {
      for (int j = 0; j < i; j++) {
        normal.at(i, j) = normal.at(j, i) = 0.5 * (normal.at(i, j) + normal.at(j, i));
        along.at(i, j) = along.at(j, i) = 0.5 * (along.at(i, j) + along.at(j, i));
      }
    }
  }
};

// Normal impulses without friction.
inline void press(const Coupled& by, std::vector<Struck>& feet) {
  std::vector<double> gain;
  for (const Struck& one : feet) gain.push_back(one.target + one.at.speed);
  const std::vector<double> found = complementary_impulses(by.normal, gain);
  for (size_t i = 0; i < feet.size(); i++) feet[i].impulse = found[i];
}

// Kinetic energy [J] that the impulses on each foot take: those at rates halfway between before and after. Along the ground others may drag a foot so that
// its own share would be negative; then the rest bear it. ``slips`` [m/s]: along the ground after the impact.
inline std::vector<double> taken(const Coupled& by, const std::vector<Struck>& feet, const std::vector<double>& slips) {
  std::vector<double> out;
  double all = 0.0, positive = 0.0;
  for (size_t i = 0; i < feet.size(); i++) {
    const double one = 0.5 * (feet[i].impulse * (feet[i].at.speed - feet[i].target) - feet[i].braked * (by.slip[i] + slips[i]));
    all += one;
    out.push_back(std::max(one, 0.0));
    positive += out.back();
  }
  const double share = positive > 0.0 ? std::max(all, 0.0) / positive : 1.0;
  for (double& one : out) one *= share;
  return out;
}

// Rates along the ground after the impact.
inline std::vector<double> slips_after(const Coupled& by, const std::vector<Struck>& feet) {
  std::vector<double> out = by.slip;
  for (int i = 0; i < by.normal.size; i++) {
    for (int j = 0; j < by.normal.size; j++) out[i] += by.by_along.at(j, i) * feet[j].impulse + by.along.at(i, j) * feet[j].braked;
  }
  return out;
}

// What impulses along the ground do while the feet that are hit depart with their targets: normal impulses follow as K (gain - C p), and rates along the
// ground when restitution begins are s + C^T K speed + (T - C^T K C) p.
struct Dragged {
  std::vector<uint8_t> hit;
  std::vector<double> pressed, slip;  // normal impulses, and rates along the ground, without friction
  Square shift, mobility;             // of normal impulses, and of rates along the ground, by impulses along it

  Dragged(const Coupled& by, const std::vector<Struck>& feet, std::vector<uint8_t> which)
      : hit(std::move(which)), slip(by.slip), shift(by.normal.size), mobility(by.along) {
    const int n = by.normal.size;
    std::vector<double> speed, gain;
    for (const Struck& one : feet) {
      speed.push_back(one.at.speed);
      gain.push_back(one.at.speed + one.target);
    }
    const Square k = pseudoinverse(by.normal, hit);
    const std::vector<double> compressed = k.times(speed);
    pressed = k.times(gain);
    for (int i = 0; i < n; i++) {
      for (int j = 0; j < n; j++) {
        slip[i] += by.by_along.at(j, i) * compressed[j];
        for (int l = 0; l < n; l++) shift.at(i, j) -= k.at(i, l) * by.by_along.at(l, j);
      }
    }
    for (int i = 0; i < n; i++) {
      for (int j = 0; j < n; j++) {
        for (int l = 0; l < n; l++) mobility.at(i, j) += by.by_along.at(l, i) * shift.at(l, j);
      }
    }
    for (int i = 0; i < n; i++) {
      for (int j = 0; j < i; j++) mobility.at(i, j) = mobility.at(j, i) = 0.5 * (mobility.at(i, j) + mobility.at(j, i));
    }
  }
};

// Friction on the feet that are hit, within its cones. It takes no more than its push from a foot, and lets no other approach faster than its target.
inline std::vector<double> braked_by(const Modal& m, const Coupled& by, const std::vector<Struck>& feet, const Dragged& with) {
  const int n = by.normal.size;
  std::vector<uint8_t> free(n, 0);
  Bounds bounds;
  for (int i = 0; i < n; i++) {
    std::vector<double> less(n);  // of the normal impulse, or of the rate of a foot that is not hit
    for (int j = 0; j < n; j++) {
      less[j] = with.hit[i] ? -with.shift.at(i, j) : -by.by_along.at(i, j);
      for (int l = 0; l < n && !with.hit[i]; l++) less[j] -= by.normal.at(i, l) * with.shift.at(l, j);
    }
    const double gain = feet[i].at.speed + feet[i].target;
    if (!with.hit[i]) {
      double rises = -gain;
      for (int j = 0; j < n; j++) rises += by.normal.at(i, j) * with.pressed[j];
      bounds.add(less, rises);
      continue;
    }
    const double ratio = m.frictional[feet[i].foot] ? m.laws.friction(feet[i].foot, gain, 0.0, std::fabs(by.slip[i])) / gain : 0.0;
    free[i] = ratio > 0.0 && with.mobility.at(i, i) > NO_PART * by.along.at(i, i);
    if (!free[i]) {
      bounds.add(less, with.pressed[i]);
      continue;
    }
    for (double& one : less) one *= ratio;
    for (const double sign : {1.0, -1.0}) {
      std::vector<double> cone = less;
      cone[i] += sign;
      bounds.add(std::move(cone), ratio * with.pressed[i]);
    }
  }
  return LeastEnergy(with.mobility, by.along, with.slip, free, bounds).impulses();
}

// Impulses with friction. Feet from which it takes all of their push are free to depart faster than their targets: the others' friction then goes on
// without them. That leaves less energy still.
inline void brake_together(const Modal& m, const Coupled& by, std::vector<Struck>& feet) {
  std::vector<uint8_t> hit;
  for (const Struck& one : feet) hit.push_back(one.hit());
  for (bool fewer = true; fewer;) {
    const Dragged with(by, feet, hit);
    const std::vector<double> braked = braked_by(m, by, feet, with), moved = with.shift.times(braked);
    double most = 0.0;
    for (size_t i = 0; i < feet.size(); i++) most = std::max(most, with.pressed[i] + moved[i]);
    fewer = false;
    for (size_t i = 0; i < feet.size(); i++) {
      const bool pushes = hit[i] && with.pressed[i] + moved[i] > NO_PART * most;
      feet[i].impulse = pushes ? with.pressed[i] + moved[i] : 0.0;
      feet[i].braked = pushes ? braked[i] : 0.0;
      fewer = fewer || (hit[i] && !pushes);
      hit[i] = pushes;
    }
  }
}

// All impulses, for the targets.
inline void strike(const Modal& m, const Coupled& by, std::vector<Struck>& feet) {
  for (Struck& one : feet) one.braked = 0.0;
  press(by, feet);
  if (m.sizes.ways > 0) brake_together(m, by, feet);
}

// The state after the impulses. Their sums leave rates that miss the targets by rounding; of feet that friction lets no impulse that would be approach
// or departure, so they are brought there once more.
inline void apply_impulses(Modal& m, const Coupled& by, const std::vector<Struck>& feet) {
  double most = 0.0;
  for (const Struck& one : feet) {
    if (one.hit()) m.shift(m.mode->beta, one.foot, one.impulse);
    if (one.braked != 0.0) m.shift(m.mode->slide, one.foot, one.braked);
    most = std::max(most, one.at.speed);
  }
  std::vector<double> misses;
  std::vector<uint8_t> close;
  for (const Struck& one : feet) {
    misses.push_back(one.target - m.rate_of(one.foot));
    close.push_back(std::fabs(misses.back()) <= NO_PART * most);
  }
  const std::vector<double> more = pseudoinverse(by.normal, close).times(misses);
  for (size_t i = 0; i < feet.size(); i++) {
    if (close[i]) m.shift(m.mode->beta, feet[i].foot, more[i]);
  }
}

// What ``ask`` finds once the impulses have acted, with the feet that are ``held``, and are hit, on the ground.
template <class Ask>
void once_struck(Modal& m, const Coupled& by, const std::vector<Struck>& feet, const std::vector<uint8_t>& held, Ask&& ask) {
  const std::vector<double> state(m.state(), m.state() + m.sizes.state());
  FootSet set = m.mode->feet;
  for (size_t i = 0; i < feet.size(); i++) {
    if (held[i] && feet[i].hit()) set.set(feet[i].foot, true);
  }
  apply_impulses(m, by, feet);
  in_mode(m, m.book.require(set), [&] {
    ask();
    return 0.0;
  });
  std::copy(state.begin(), state.end(), m.state());
}

// Which feet are stopped: those that stay where all of them are, and none is pulled off; or that the others throw off so. Those that are
// pulled off bounce, and with them no foot departs more slowly than it would.
inline std::vector<uint8_t> captured_together(Modal& m, const Coupled& by, std::vector<Struck>& feet) {
  const size_t n = feet.size();
  std::vector<uint8_t> held(n, 1);
  for (bool changed = true; changed;) {
    for (size_t i = 0; i < n; i++) feet[i].target = held[i] ? 0.0 : feet[i].at.after;
    strike(m, by, feet);
    changed = false;
    std::vector<double> pull;
    once_struck(m, by, feet, held, [&] { pull = moment_of(m).pull; });
    for (size_t i = 0; i < n; i++) {
      if (!held[i] || !feet[i].hit()) continue;
      const int foot = feet[i].foot;
      feet[i].at.pull = pull[foot];
      if (m.laws.has(foot, HAS_FORCE)) feet[i].at.pull += m.force_now(foot, 0.0, 0.0);
      if (landing_kind(m.laws, foot, feet[i].at, m.settings.rest_height) == CAPTURE) continue;
      held[i] = 0;
      changed = true;
    }
    for (size_t i = 0; i < n && changed; i++) held[i] = held[i] && feet[i].hit();
  }
  return held;
}

// How each foot lands, and its impulses.
inline void decide_together(Modal& m, const Coupled& by, std::vector<Struck>& feet) {
  for (Struck& one : feet) {
    if (one.at.after == 0.0) one.at.none = no_pull(m, one.foot, m.clock.time);
  }
  const std::vector<uint8_t> held = captured_together(m, by, feet);
  once_struck(m, by, feet, held, [&] {
    for (size_t i = 0; i < feet.size(); i++) {
      Struck& one = feet[i];
      one.kind = held[i] ? CAPTURE : BOUNCE;
      if (held[i] || m.mode->mobility[one.foot] == 0.0) continue;
      one.at.mobility = m.mode->mobility[one.foot];
      one.at.pull = pull_if_held(m, one.foot);
      one.kind = landing_kind(m.laws, one.foot, one.at, m.settings.rest_height);
      if (one.kind == CAPTURE) one.kind = BOUNCE;  // with the others held it would be pulled off
    }
  });
  for (Struck& one : feet) one.target = one.kind == BOUNCE ? one.at.after : 0.0;
  strike(m, by, feet);
}

// How the structure follows beyond the mass-weighted map, as `follow_impact`, from the state before the impulses: each foot's direction across
// its normal, by its impulse, less what would change the rates of the feet that land with it. Returns the kinetic energy [J] that this takes.
inline double follow_across(Modal& m, const Coupled& by, const std::vector<Struck>& feet) {
  const int n = by.normal.size, state = m.sizes.state();
  const ContactMode& mode = *m.mode;
  std::vector<double> across(state, 0.0), amount(n, 0.0), speed(n), target(n), moved(n, 0.0);
  std::vector<uint8_t> hit(n);
  bool as_is = false;
  for (int i = 0; i < n; i++) {
    const int foot = feet[i].foot;
    hit[i] = feet[i].hit();
    speed[i] = feet[i].at.speed;
    target[i] = feet[i].target;
    if (!hit[i] || feet[i].kind != BOUNCE || mode.skew[foot] == 0.0) continue;
    as_is = as_is || m.laws.has(foot, MAP_AS_IS);
    amount[i] = feet[i].impulse * mode.skew[foot] * std::sqrt(mode.mobility[foot]);
    for (int k = 0; k < state; k++) across[k] += amount[i] * mode.side[foot * state + k];
  }
  if (largest(amount) == 0.0) return 0.0;
  const Square inverse = pseudoinverse(by.normal, hit);
  for (int i = 0; i < n; i++) {
    for (int k = 0; k < state; k++) moved[i] += mode.outputs[(m.sizes.feet + feet[i].foot) * state + k] * across[k];
  }
  const std::vector<double> less = inverse.times(moved);
  for (int i = 0; i < n; i++) {
    for (int k = 0; k < state; k++) across[k] -= less[i] * mode.beta[feet[i].foot * state + k];
  }
  double square = 0.0, before = 0.0, approach = 0.0, departure = 0.0;  // in the mass metric, by twice the kinetic energies
  const std::vector<double> stopped = inverse.times(speed), thrown = inverse.times(target);
  for (int i = 0; i < n; i++) {
    const double* row = mode.side_rate + feet[i].foot * state;
    for (int k = 0; k < state && amount[i] != 0.0; k++) square += amount[i] * row[k] * across[k];
    if (amount[i] != 0.0) before += amount[i] * m.along(m.mode->side_rate, feet[i].foot);
    before += less[i] * speed[i];
    approach += speed[i] * stopped[i];
    departure += target[i] * thrown[i];
  }
  if (!(square > REDUNDANT * REDUNDANT * approach)) return 0.0;  // the feet that land with them leave the directions no room
  const double size = std::sqrt(square), a = std::sqrt(approach), e = std::sqrt(std::max(departure, 0.0) / approach);
  before /= size;
  const FollowedBy by_map(e, size / ((1.0 + e) * a), as_is);
  const double then = by_map.alpha * before + by_map.beta * a;
  for (int k = 0; k < state; k++) m.state()[k] += across[k] * ((then - before) / size);
  return 0.5 * (before * before - then * then);
}

// ---- the impact

// The feet on the ground, or within what rounding leaves of a gap of it, that approach it. In the time to which a root is known, 1e-15 of a
// step, a foot moves by less than that: the gap's own terms bound its way in a step.
inline std::vector<Struck> landing_now(Modal& m, int first) {
  std::vector<Struck> out;
  for (int i : m.mode->free) {
    const bool lands = i == first || (m.mode->mobility[i] > 0.0 && m.feet[i].departure <= UNDER_WAY && m.gaps[i] <= m.no_gap(i) && -m.rate_of(i) > m.no_rate(i));
    if (lands) out.push_back({i, {}, 0.0});
  }
  return out;
}

// Feet held on the ground that the impact pulls off, and those that stick and slide now, go first: it then acts without them, see `impact`.
inline bool detaches(Modal& m, const std::vector<Struck>& feet) {
  bool low = true;
  std::vector<Blow> blows;
  for (const Struck& one : feet) {
    low = low && too_low_to_detach(m, one.at);
    if (one.hit()) blows.push_back({one.foot, one.impulse, one.braked});
  }
  if (low) return false;
  const std::vector<Broken> broken = broken_by(m, blows);
  if (broken.empty()) return false;
  for (const Struck& one : feet) m.feet[one.foot].departure = DUE;
  release_by_impact(m, broken);
  return true;
}

// Log what happens to a foot that is hit; lost [J]: what the impact takes of its energy.
inline void log_landing(Modal& m, const Struck& one, double lost) {
  const double t = m.clock.time, share = one.at.after / one.at.speed;
  EventNumbers numbers = numbers_of(m.laws, one.foot, one.kind, t, one.at, lost);
  if (one.kind == CAPTURE && m.laws.has(one.foot, HAS_LATCH)) numbers.adhesion = lost * share * share;
  m.log.add(one.foot, one.kind, m.feet[one.foot].apex, numbers);
}

// The impact of several feet; the state is the modal one.
TARSUS_APART inline void land_together(Modal& m, std::vector<Struck> feet) {
  const double t = m.clock.time;
  for (Struck& one : feet) {
    m.gaps[one.foot] = 0.0;
    m.feet[one.foot].departure = UNDER_WAY;
  }
  for (Struck& one : feet) {
    one.at = landing_of(m, one.foot);
    one.target = one.at.after;
  }
  const Coupled by(m, feet);
  strike(m, by, feet);
  if (detaches(m, feet)) return;
  decide_together(m, by, feet);
  m.begin_notes();
  for (const Struck& one : feet) {
    if (one.kind != BOUNCE) m.feet[one.foot].forces = pull_parts(m, one.foot, t);
  }
  const std::vector<double> slips = slips_after(by, feet);
  const double across = follow_across(m, by, feet);
  const std::vector<double> takes = taken(by, feet, slips);
  const double lost = std::accumulate(takes.begin(), takes.end(), 0.0);
  const double more = lost > 0.0 ? 1.0 + across / lost : 1.0;  // what the map takes across, by the feet's own shares
  double fastest = 0.0;
  for (const Struck& one : feet) fastest = std::max(fastest, one.at.speed);
  apply_impulses(m, by, feet);
  FootSet held = m.mode->feet;
  for (size_t i = 0; i < feet.size(); i++) {
    const Struck& one = feet[i];
    if (!one.hit()) {  // the others throw it off; or it lies there now
      m.feet[one.foot].departure = m.rate_of(one.foot) > std::max(m.no_rate(one.foot), NO_PART * fastest) ? RISING : UNDER_WAY;
      continue;
    }
    count_low(m, one.foot, one.at.speed, t);
    log_landing(m, one, takes[i] * more);
    if (one.kind == BOUNCE) {
      turn_over(m, one.foot, one.at.after > m.no_rate(one.foot) ? RISING : FROM_REST, t);
      continue;
    }
    held.set(one.foot, true);
    if (put_down(m, one.foot, t)) held.set(m.sizes.feet + one.foot, true);
  }
  if (held.words == m.mode->feet.words) return remove_film_momenta(m);
  leave_mode(m, m.book.require(held));
}

}  // namespace tarsus::modal
