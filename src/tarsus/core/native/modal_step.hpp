// One step, and how long the next one is: what a rejected or an accepted step, the film and the next event ask for.
#pragma once
#include "modal_collocate.hpp"
#include "modal_land.hpp"
#include "peak.hpp"

namespace tarsus::modal {

// Classes to go down after a step with that error. A step that was not tried for where it leads (negative room) is cut
// down to what may be used of it. One that runs into the ground fails for what lies below it: one class down often ends
// above.
inline int classes_down(const Modal& m, double error) {
  for (int i : m.mode->free) {
    if (m.room[i] < 0.0) return 1 + int(-std::log2(1.0 + m.room[i]));
  }
  for (int i : m.mode->free) {
    if (m.linear[i][N - 1] < 0.0) return 1;
  }
  if (!(error > 1.0)) return 2;
  return 1 + int(std::min(std::log2(error), 90.0) * 0.11);
}

// First step class in a contact mode: one to land in, or what the film let pass at the last start.
inline int launch_class(const Modal& m) {
  const int k = m.mode->landing_class;
  return !m.acting.empty() && m.acting[0] < 2 * m.sizes.feet ? std::max(k, m.last_launch) : k;
}

// Longest shorter class that ends within a fraction of class k (at least one class down).
inline int shorter_class(const std::vector<double>& lengths, int k, double fraction) {
  int n = k + 1;
  while (n < int(lengths.size()) - 1 && lengths[n] > fraction * lengths[k]) n++;
  return n;
}

// Taylor terms that carry the flow over a fraction of a step of class k, 0 if that is too far.
inline int landing_terms(const ContactMode& mode, const std::vector<double>& lengths, int k, double fraction) {
  int n = k;
  while (n < int(lengths.size()) - 1 && lengths[n + 1] >= fraction * lengths[k]) n++;
  return mode.terms[n];
}

// Class to try next. The tail of a step goes with h^9 and with the growth of the forces that caused it: a class longer for
// every ten powers of two that are left. An event that linear motion puts inside the next step needs one to land in.
inline int next_class(const Modal& m, int k, int wanted, double error, double h, bool event) {
  const std::vector<double>& lengths = m.book.lengths;
  const int last = int(lengths.size()) - 1;
  double expected = error, one = 1.0;  // compared without a division
  if (!event) {
    expected = error * m.growth_after * m.growth_after;
    one = m.growth_before * m.growth_before;
  }
  if (expected > 0.5 * one) {
    wanted = std::max(wanted, k + 1);
  } else if (k <= wanted) {
    wanted = std::max(k - (expected < 1e-3 * one) - (expected < 1e-6 * one) - (expected < 1e-9 * one), 0);
  }
  wanted = std::min(wanted, last);
  const double dt = (m.nodes.tau[N - 1] - m.nodes.tau[N - 2]) * h;
  double ahead = event ? 0.0 : INF, drops = 1.0;  // time to the event, as a fraction
  for (int i = 0; i < m.sizes.feet; i++) {
    const Row& margin = m.margin[i];
    const double drop = margin[N - 2] - margin[N - 1];
    if (!(drop > 0.0)) continue;
    if (margin[N - 1] * dt * drops < ahead * drop) {
      ahead = margin[N - 1] * dt;
      drops = drop;
    }
    if (m.mode->is_held[i] || !m.laws.has(i, HAS_MOMENTUM)) continue;
    const double film = m.values[i][N - 1] - m.values[i][N - 2], room = 1.8 * m.values[i][N - 1] * dt;
    while (film > 0.0 && lengths[wanted] * film > room && wanted < last) wanted++;
  }
  while (m.mode->terms[wanted] == 0 && lengths[wanted] * drops > ahead && wanted < last) wanted++;
  return wanted;
}

// What a step came to.
struct Taken {
  Code code = GOING_ON;
  int foot = -1;  // with an event at its end
};

// How far a run may go: to the next kink of a drive or the end or mark, and beyond a kink as far as it may be continued.
struct Ahead {
  double goal, left, reach;
};

inline Ahead look_ahead(Modal& m) {
  const double t = m.clock.time, goal = std::min(m.settings.end, m.clock.mark);
  const Player::Kink kink = m.player.next_kink(t);
  return {goal, std::min(kink.left, goal - t), kink.reach};
}

// Go on to the end of a step or to the event inside it. Returns whether all numbers are finite.
template <class S>
TARSUS_INLINE bool advance(Modal& m, const StepClass& step, const Located& at, const Ahead& ahead, double limit, int terms) {
  const double t = m.clock.time, h = step.length, fraction = at.foot >= 0 ? at.s : limit;
  if (m.settings.track) {
    for (int i : m.mode->free) {
      raise_apex(m.nodes, m.feet[i].apex, reinterpret_cast<const double*>(&m.outputs[i]), fraction, t, h);
    }
  }
  m.record(step, fraction);
  bool finite = true;
  if (at.foot < 0 && h <= ahead.left) {
    finite = flow<S>(m, step);
    m.clock.time = t + h;
  } else {
    finite = state_at<S>(m, step, terms, fraction);
    m.clock.time = at.foot >= 0 ? t + fraction * h : ahead.left == ahead.goal - t ? ahead.goal : t + ahead.left;
  }
  m.accept();
  if (fraction > 0.0) {
    for (int i = 0; i < m.sizes.feet; i++) {
      if (i != at.foot) m.feet[i].departure = UNDER_WAY;
    }
  }
  return finite;
}

// One step by a method with attempt(m, step, t) -> error and scan(m, step, t, limit) -> Scan.
template <class S, class Method>
TARSUS_INLINE Taken take_step(Modal& m, const Method& method, const Ahead& ahead) {
  const std::vector<double>& lengths = m.book.lengths;
  const ContactMode& mode = *m.mode;
  const double t = m.clock.time;
  int k = m.step_class, wanted = k;
  for (;;) {
    if (k >= int(lengths.size())) return {STEP_TOO_SMALL};
    const double h = lengths[k];
    if (h > ahead.left && (mode.terms[k] == 0 || h > ahead.reach)) {
      k++;
      continue;
    }
    const StepClass& step = m.take_class(k);
    const double error = method.attempt(m, step, t);
    if (!(0.0 <= error && error <= 1.0)) {
      m.clock.rejected++;
      k += classes_down(m, error);
      wanted = std::max(wanted, k);
      continue;
    }
    const double limit = std::min(1.0, ahead.left / h);
    const Scan seen = method.scan(m, step, t, limit);
    const double far = std::max(h > ahead.left ? limit : 0.0, seen.far);
    const int terms = far > 0.0 ? landing_terms(mode, lengths, k, std::min(far, limit)) : 0;
    if (far > 0.0 && terms == 0) {
      m.clock.rejected++;
      k = shorter_class(lengths, k, std::max(seen.interval < N ? m.nodes.tau[seen.interval - 1] : 0.0, 0.125));
      continue;
    }
    if (seen.coarse && mode.terms[k] == 0) {
      k++;
      continue;
    }
    Located at;
    if (far > 0.0) {
      scale_inputs(m, step);
      if (seen.doubt) at = locate(m, step, t, limit, terms);
    }
    if (!advance<S>(m, step, at, ahead, limit, terms)) return {NOT_FINITE};
    if (m.launching) {
      m.launching = false;
      if (error > 0.0) m.last_launch = error < 1e-3 ? k - 1 : k;
    }
    m.step_class = next_class(m, k, wanted, error, h, at.foot >= 0);
    return {GOING_ON, at.foot};
  }
}

}  // namespace tarsus::modal
