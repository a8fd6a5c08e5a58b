// One step, and the length of the next one: by the error of a rejected or an accepted step, by the film and by the next event.
#pragma once
#include "modal/collocate.hpp"
#include "modal/land.hpp"
#include "march/peak.hpp"

namespace tarsus::modal {

// How often a step may be halved and still be as long as a fraction (0, 1) of it: the whole part of -log2.
inline int halvings(double fraction) {
  int exponent;
  const double rest = std::frexp(fraction, &exponent);  // in [0.5, 1)
  return rest > 0.5 ? -exponent : 1 - exponent;
}

// A step class is half as long as the one before, and the truncation of a step goes with the ninth power of its length: it is
// 2^9 times less in the next class.
constexpr double ERROR_PER_CLASS = 512.0;
constexpr int MOST_DOWN = 10;  // classes to go down at once: an error that asks for more is no truncation, and is estimated anew

// Errors, relative to the tolerance, below which the next step may be one, two and three classes longer: 1e-3 a class, which is
// 2^-9 with half of it to spare, so that the longer step is seldom rejected.
constexpr double ONE_LONGER = 1e-3, TWO_LONGER = 1e-6, THREE_LONGER = 1e-9;
constexpr double AIM = 0.5;  // error, relative to the tolerance, above which the next step is a class shorter: errors change by some such factor

// Least part to which a step is shortened at once, by three classes, where an event may lie in it: where it may lie is an
// estimate, which the shorter step makes anew.
constexpr double LEAST_PART = 0.125;

// Classes to go down after a step with that error. A step that was not completed because a foot would come too close to where
// its film is infinite (negative room) is cut to the part that may be used. One that ends below the ground is rejected for its
// motion there, to which laws do not apply: one class down often ends above.
inline int classes_down(const Modal& m, double error) {
  for (int i : m.mode->free) {
    if (m.room[i] < 0.0) return 1 + halvings(1.0 + m.room[i]);
  }
  for (int i : m.mode->free) {
    if (m.linear[i][N - 1] < 0.0) return 1;
  }
  if (!(error > 1.0)) return 2;
  int down = 1;
  for (double most = ERROR_PER_CLASS; error > most && down < MOST_DOWN; most *= ERROR_PER_CLASS) down++;
  return down;
}

// First step class in a contact mode: one in which an event can be located, or the one that the film allowed at the last start.
// It is a class shorter for each time that a foot released now has risen by less than the error of a step and was pressed down
// again at once.
inline int launch_class(const Modal& m) {
  int k = m.mode->landing_class, lost = 0;
  if (!m.acting.empty() && m.acting[0] < 2 * m.sizes.feet) k = std::max(k, m.last_launch);
  for (int i : m.mode->free) {
    if (m.just_released(i)) lost = std::max(lost, m.feet[i].low);
  }
  return lost > 0 ? std::min(k + lost, int(m.book.lengths.size()) - 1) : k;
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

// Growth of a film's momentum over the last node interval of a step, at its rate of growth at the end: by the parabola through
// three nodes.
inline double growth_at_end(const Nodes& nodes, const Row& film) {
  const double last = nodes.tau[N - 1] - nodes.tau[N - 2], before = nodes.tau[N - 2] - nodes.tau[N - 3];
  const double grown = film[N - 1] - film[N - 2];
  return grown + (grown - (last / before) * (film[N - 2] - film[N - 3])) * (last / (last + before));
}

// Class to try next. The truncation of the next step goes with ERROR_PER_CLASS and with the growth of the force that causes it.
// Where linear motion puts an event inside the next step, that must be of a class in which an event can be located.
inline int next_class(const Modal& m, int k, int wanted, double error, double h, bool event) {
  const std::vector<double>& lengths = m.book.lengths;
  const int last = int(lengths.size()) - 1;
  double expected = error, one = 1.0;  // expected error: their ratio, compared without a division
  if (!event) {
    expected = error * m.growth_after * m.growth_after;
    one = m.growth_before * m.growth_before;
  }
  if (expected > AIM * one) {
    wanted = std::max(wanted, k + 1);
  } else if (k <= wanted) {
    wanted = std::max(k - (expected < ONE_LONGER * one) - (expected < TWO_LONGER * one) - (expected < THREE_LONGER * one), 0);
  }
  wanted = std::min(wanted, last);
  const double dt = (m.nodes.tau[N - 1] - m.nodes.tau[N - 2]) * h;
  double ahead = event ? 0.0 : INF, drops = 1.0;  // time to the event, as a fraction
  for (int i = 0, events = m.events(); i < events; i++) {
    const Row& margin = m.margin[i];
    const double drop = margin[N - 2] - margin[N - 1];
    if (!(drop > 0.0)) continue;
    if (margin[N - 1] * dt * drops < ahead * drop) {
      ahead = margin[N - 1] * dt;
      drops = drop;
    }
    if (i >= m.sizes.feet || m.mode->is_held[i] || !m.laws.has(i, HAS_MOMENTUM)) continue;
    // a film P ~ 1/(g + g0)^2 is 2 P/P' away from where it is infinite: not more than DEEP of that (see runs_deep); a momentum that
    // is no film's, counted from elsewhere, may be below 0 and shows no such place
    const double film = growth_at_end(m.nodes, m.values[i]), room = 2.0 * DEEP * (m.values[i][N - 1] + (m.strong ? m.feet[i].base : 0.0)) * dt;
    while (film > 0.0 && room > 0.0 && lengths[wanted] * film > room && wanted < last) wanted++;
  }
  while (m.mode->terms[wanted] == 0 && lengths[wanted] * drops > ahead && wanted < last) wanted++;
  return wanted;
}

// Result of a step.
struct Taken {
  Code code = GOING_ON;
  int foot = -1;  // of the first event at its end, see Modal::happening; -1: none
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

// A step being tried: its class, and the class of the one after it, which rejected trials make shorter.
struct Trial {
  int k, wanted;
};

// Go on to a class that fits what is ahead. False where all are too long.
inline bool fit(const Modal& m, const Ahead& ahead, Trial& trial) {
  const std::vector<double>& lengths = m.book.lengths;
  int& k = trial.k;
  while (k < int(lengths.size()) && lengths[k] > ahead.left && (m.mode->terms[k] == 0 || lengths[k] > ahead.reach)) k++;
  return k < int(lengths.size());
}

// Whether a step's error is too large; then the next trial is shorter.
inline bool rejects(Modal& m, double error, Trial& trial) {
  if (0.0 <= error && error <= 1.0) return false;
  m.clock.rejected++;
  m.refused.refuse(trial.k);
  trial.k += classes_down(m, error);
  trial.wanted = std::max(trial.wanted, trial.k);
  return true;
}

// The state is at the end of a step: choose the next one.
TARSUS_INLINE void end_step(Modal& m, const Trial& trial, double error, double h, bool event) {
  if (m.launching) {
    m.launching = false;
    if (error > 0.0) m.last_launch = error < ONE_LONGER ? trial.k - 1 : trial.k;
  }
  if (event) m.refused = {};
  m.step_class = m.refused.next(next_class(m, trial.k, trial.wanted, error, h, event), trial.k);
}

inline void raise_apexes(Modal& m, const StepClass& step, double fraction) {
  if (!m.settings.track) return;
  for (int i : m.mode->free) {
    raise_apex(m.nodes, m.feet[i].apex, reinterpret_cast<const double*>(&m.outputs[i]), fraction, m.clock.time, step.length);
  }
}

// Go on to the end of a step or to the event inside it. Returns whether all numbers are finite.
template <class S>
TARSUS_INLINE bool advance(Modal& m, const StepClass& step, const Located& at, const Ahead& ahead, double limit, int terms) {
  const double t = m.clock.time, h = step.length, fraction = at.foot >= 0 ? at.s : limit;
  raise_apexes(m, step, fraction);
  bool finite = true;
  if (at.foot < 0 && h <= ahead.left) {
    finite = flow<S>(m, step);
    m.clock.time = t + h;
    m.film_now = m.values[0][N - 1];
  } else {
    m.film_now = NOT_A_NUMBER;
    finite = state_at<S>(m, step, terms, fraction);
    m.clock.time = at.foot >= 0 ? t + fraction * h : ahead.left == ahead.goal - t ? ahead.goal : t + ahead.left;
  }
  m.accept();
  m.ended = fraction;
  if (m.observer != nullptr) m.observer->accepted(step, t, fraction);
  if (fraction > 0.0) {
    for (int i = 0; i < m.sizes.feet; i++) {
      if (i != at.foot) m.feet[i].departure = UNDER_WAY;
    }
    for (int i = 0; i < m.sizes.ways; i++) m.feet[i].slide = UNDER_WAY;
  }
  return finite;
}

// Part of a step that counts: up to the next kink, mark or end.
TARSUS_INLINE double limit_of(const StepClass& step, const Ahead& ahead) { return std::min(1.0, ahead.left / step.length); }

// Take a step whose attempt had that error and whose events are bounded by ``seen``: all of it, or its part up to the first
// event or to the next kink, mark or end. False where a shorter one is to be tried.
template <class S>
TARSUS_INLINE bool take(Modal& m, const StepClass& step, const Scan& seen, double error, const Ahead& ahead, Trial& trial,
                        Taken& taken) {
  const std::vector<double>& lengths = m.book.lengths;
  const int k = trial.k;
  const double t = m.clock.time, h = step.length, limit = limit_of(step, ahead);
  const double far = std::max(h > ahead.left ? limit : 0.0, seen.far);
  const int terms = far > 0.0 ? landing_terms(*m.mode, lengths, k, std::min(far, limit)) : 0;
  if (far > 0.0 && terms == 0) {
    m.clock.rejected++;
    m.refused.refuse(trial.k);
    trial.k = shorter_class(lengths, k, std::max(seen.interval < N ? m.nodes.tau[seen.interval - 1] : 0.0, LEAST_PART));
    return false;
  }
  if (seen.coarse && m.mode->terms[k] == 0) {
    m.clock.rejected++;
    m.refused.refuse(trial.k);
    trial.k++;
    return false;
  }
  Located at;
  if (far > 0.0) {
    scale_inputs(m, step);
    if (seen.unresolved) at = locate(m, step, t, limit, terms);
  }
  taken = {GOING_ON, at.foot};
  if (!advance<S>(m, step, at, ahead, limit, terms)) {
    taken.code = NOT_FINITE;
  } else {
    end_step(m, trial, error, h, at.foot >= 0);
  }
  return true;
}

// One step by a method with attempt(m, step, t) -> error and scan(m, step, t, limit) -> Scan.
template <class S, class Method>
TARSUS_INLINE Taken take_step(Modal& m, const Method& method, const Ahead& ahead, Trial trial) {
  Taken taken{STEP_TOO_SMALL};
  while (fit(m, ahead, trial)) {
    const StepClass& step = m.take_class(trial.k);
    const double error = method.attempt(m, step, m.clock.time);
    if (m.jammed) return {JAMMED};
    if (rejects(m, error, trial)) continue;
    const Scan seen = method.scan(m, step, m.clock.time, limit_of(step, ahead));
    if (take<S>(m, step, seen, error, ahead, trial, taken)) break;
  }
  return taken;
}

}  // namespace tarsus::modal
