// Robots by contact modes, as the march takes them: a structure of a few modes with exact flow from event to event.
#pragma once
#include "modal/due.hpp"
#include "modal/one.hpp"
#include "modal/step.hpp"

namespace tarsus::modal {

// Steps of any feet under any laws, or of one foot: see take_step.
template <class S>
struct AnyFeet {
  const OneFoot& foot;
  double attempt(Modal& m, const StepClass& step, double t) const { return modal::attempt<S>(m, step, t); }
  Scan scan(Modal& m, const StepClass& step, double t, double limit) const { return modal::scan<S>(m, step, t, limit); }
};

template <class S>
struct OneFree {
  const OneFoot& foot;
  TARSUS_INLINE double attempt(Modal& m, const StepClass& step, double t) const { return attempt_free<S>(m, foot, step, t); }
  TARSUS_INLINE Scan scan(Modal& m, const StepClass& step, double, double limit) const { return scan_one<S>(m, step, limit); }
};

template <class S>
struct OneHeld {
  const OneFoot& foot;
  TARSUS_INLINE double attempt(Modal& m, const StepClass& step, double t) const { return attempt_held<S>(m, foot, step, t); }
  TARSUS_INLINE Scan scan(Modal& m, const StepClass& step, double, double limit) const { return scan_one<S>(m, step, limit); }
};

// Whether feet that are all held stay so for ``left`` at least, under drives that do not change. Each pull deviates from its
// value at rest by no more than its modal amplitudes: with y = state, c y(t) = c y - c T^-1 y' + c T^-1 exp(T t) y', where
// ``level`` is c T^-1 and ``amplitude_bound`` the largest norm of c T^-1 exp(T t) in each block.
template <class S>
bool stays_held(Modal& m, double left) {
  const ContactMode& mode = *m.mode;
  const int ns = m.sizes.stride, ni = m.sizes.inputs();
  const double t = m.clock.time, *w = m.state();
  double* z = m.chain();
  for (int b = 0; b < ns; b++) {
    z[b] = mode.blocks[b] * w[b] + mode.blocks[ns + b] * w[ns + b];
    z[ns + b] = mode.blocks[2 * ns + b] * w[b] + mode.blocks[3 * ns + b] * w[ns + b];
  }
  for (int r = 0; r < 2 * ns; r++) z[r] += m.bias->inputs[r];
  for (int i : m.inputs) {
    for (int r = 0; r < 2 * ns; r++) z[r] += mode.inputs[i * 2 * ns + r] * m.value(i)[0];
  }
  double amplitude_bound = 0.0;
  const auto at_rest = [&](int o) {
    double level = m.along(mode.outputs, o) + m.bias->feed[o];
    for (int r = 0; r < 2 * ns; r++) level -= mode.level[o * 2 * ns + r] * z[r];
    for (int f = 2 * m.sizes.feet; f < m.sizes.last(); f++) level += mode.feed[o * ni + f] * m.value(f)[0];
    level += m.of_places(o);
    amplitude_bound = 0.0;
    for (int b = 0; b < mode.blocks_used; b++) amplitude_bound += mode.amplitude_bound[o * ns + b] * std::sqrt(z[b] * z[b] + z[ns + b] * z[ns + b]);
    return level;
  };
  for (int i = 0; i < m.sizes.feet; i++) {
    const double pull = at_rest(i), most = pull + amplitude_bound, least = pull - amplitude_bound;
    const Row times = t + m.nodes.times() * left, breaking = breaking_pull(m, i, times, Row(m.volts[i][0])), margin = breaking - most;
    if (any_not_below(Row(m.settings.force_zero), margin)) return false;
    if (!mode.is_stuck[i]) continue;
    const double along = std::fabs(at_rest(m.sizes.feet + i)) + amplitude_bound + m.settings.force_zero;
    for (const Row& bearing : {margin, breaking - least}) {
      const Row bound = m.laws.friction(i, bearing, m.laws.strength(i, times - m.feet[i].since, Row(m.volts[i][0])), Row(0.0));
      if (any_not_below(Row(along), bound)) return false;
    }
  }
  return true;
}

// Where no event is possible until the drives change: the longest step that fits, by its flow alone. False where an event is
// possible, or where the rest is short enough to be cut from a step in which events can be located.
template <class S>
TARSUS_APART bool glide(Modal& m, double left) {
  const std::vector<double>& lengths = m.book.lengths;
  int k = 0;
  while (k < int(lengths.size()) && m.mode->terms[k] == 0 && lengths[k] > left) k++;
  if (k == int(lengths.size()) || m.mode->terms[k] > 0) return false;
  m.drive(m.clock.time, lengths[k]);
  if (!m.steady || !stays_held<S>(m, left)) return false;
  const StepClass& step = m.take_class(k);
  const double t = m.clock.time;
  flow<S>(m, step);
  m.accept();
  m.clock.time += lengths[k];
  if (m.observer != nullptr) m.observer->accepted(step, t, 1.0);
  return true;
}

// S: how the modes lie in packs.
template <class S>
struct ModalSystem : Modal {
  OneFoot one;
  double strong_gap = 0.0;  // [m] that a step may err under strong films, but for rounding

  ModalSystem(Book& b, const Nodes& n, const Signals& signals, const Laws& l, const Settings& s, size_t channels)
      : Modal(b, n, signals, l, s, channels), one(*this) {}

  // Start a run from its data.
  void begin(const RunData& run) {
    settings = units.of(run, sizes.feet);
    per_drive = 1.0 / settings.drive;
    laws.take(run.parameters);
    stopping.clear();
    jammed = false;
    for (int i = 0; i < sizes.feet; i++) frictional[i] = book.has_way(i) && has_friction(laws, i);
    biases.take(run.sources);
    physical.assign(run.initial, run.initial + 2 * sizes.coordinates);
    for (Foot& foot : feet) {
      foot = Foot();
      foot.apex.integral = settings.track ? 0.0 : NOT_A_NUMBER;
    }
    player.restart(run.channels);
    clock = Clock();
    clock.mark = settings.period;
    step_class = int(settings.first_class);
    last_launch = 0;
    next = &book.require(FootSet(sizes.constraints()));
    entering = check = true;
    take_films(run);
    one.begin(*this);
  }

  void enter() {
    if (!entering) return;
    enter_mode(*this);
    step_class = launch_class(*this);
    launching = true;
    refused = {};
    if (sizes.feet > 1 || sizes.ways > 0) check = true;
  }

  // End of a drive period, or of the run: note the highest gap since the last mark and start anew.
  void mark() {
    for (int i : mode->free) {
      log.add(clock.time, i, PERIOD_MARK, feet[i].apex);
      feet[i].apex.restart(clock.time);
    }
    clock.marks++;
    clock.mark = (clock.marks + 1) * settings.period;
  }

  bool resolve_contacts() {
    if (!check) return false;
    check = false;
    player.next_kink(clock.time);
    if (sizes.feet > 0 && resolve_due_contacts(*this)) check = true;
    return check;
  }

  Code step() {
    const Ahead ahead = look_ahead(*this);
    if (strong) {
      add_film_momenta(*this);
      allow_for_rounding();
      rebase();
      remove_film_momenta(*this);
    }
    return glides(ahead) ? GOING_ON : go_on(ahead, {step_class, step_class});
  }

  // Whether no event is possible ahead, and a long step has been made.
  TARSUS_INLINE bool glides(const Ahead& ahead) {
    return mode->free.empty() && braked.empty() && ahead.reach == INF && !launching && glide<S>(*this, ahead.left);
  }

  // One step, trying first the class of a trial, and the event at its end.
  TARSUS_INLINE Code go_on(const Ahead& ahead, const Trial& trial) {
    const bool all_held = mode->free.empty();
    return end(all_held && one.in_line    ? take_step<S>(*this, OneHeld<S>{one}, ahead, trial)
               : !all_held && one.in_film ? take_step<S>(*this, OneFree<S>{one}, ahead, trial)
                                          : any_step(ahead, trial));
  }

  // The events at the end of a step.
  TARSUS_INLINE Code end(const Taken& taken) {
    if (taken.foot < 0) return taken.code;
    happen(*this);
    check = sizes.feet > 1 || sizes.ways > 0;
    const bool stalls = std::any_of(happening.begin(), happening.end(), [&](int e) { return feet[e % sizes.feet].low >= MOST_STALLED; });
    return jammed ? JAMMED : stalls ? STALL : GOING_ON;
  }

 private:
  // A film is strong where it could bring its foot to rest many times within a run. Its momentum per mass is then as many times
  // the distance that the foot moves, and would round it (at 1e10 times accounts were open by 1e-5). The distance is as many
  // times less than the lengths that tolerances refer to, so the tolerance is reduced: down to a thousandth. Not with many feet
  // that move by themselves: Newton's method has 8 rows for each, and its steps take seconds.
  void take_films(const RunData& run) {
    constexpr double MANY = 1e4, least = 1e-3;
    constexpr int FEW = 8;
    double most = 0.0;
    for (int i = 0; i < sizes.feet; i++) {
      if (!laws.has(i, HAS_MOMENTUM)) continue;
      const double damping = -laws.momentum_slope(i, std::max(run.sources[i], 0.0), settings.probe);
      most = std::max(most, damping * next->mobility[i] * settings.end);
    }
    strong = most > MANY;
    strong_gap = settings.gap;
    rounding = 0.0;
    if (strong && std::min(sizes.feet, sizes.coordinates) <= FEW) strong_gap *= std::max(MANY / most, least);
    allow(strong_gap);
  }

  void allow(double gap) {
    settings.gap = gap;
    per_gap = 1.0 / gap;
  }

  // A gap is a sum over the modes: its nodal values, and through a strong film the momenta, have the rounding of the largest
  // terms. Of these, GAP_ROUNDING is the least tolerance to which Newton's method converges, and TAIL_ROUNDING, the rounding of
  // the highest Legendre coefficient, is excluded from the error of a step, or steps would never grow.
  void allow_for_rounding() {
    constexpr double GAP_ROUNDING = 4e-14, TAIL_ROUNDING = 2e-15;
    double most = 0.0;
    for (int i : mode->free) {
      if (!laws.has(i, HAS_MOMENTUM)) continue;
      const double* row = mode->outputs + i * sizes.state();
      double sum = std::fabs(bias->feed[i]);
      for (int r = 0; r < sizes.state(); r++) sum += std::fabs(row[r] * state()[r]);
      most = std::max(most, sum);
    }
    allow(std::max(strong_gap, GAP_ROUNDING * most));
    rounding = TAIL_ROUNDING * most;
  }

  TARSUS_APART Taken any_step(const Ahead& ahead, const Trial& trial) {
    return take_step<S>(*this, AnyFeet<S>{one}, ahead, trial);
  }
};

}  // namespace tarsus::modal
