// The state of a run by contact modes from step to step, and the rows of the present step.
#pragma once
#include "laws/laws.hpp"
#include "march/grip.hpp"
#include "march/log.hpp"
#include "march/march.hpp"
#include "modal/bias.hpp"
#include "base/pack.hpp"
#include "drives/signals.hpp"

namespace tarsus::modal {

// How a free foot begins a step. At the ground its gap starts at zero and rises with the first power of time after a
// bounce, with a higher one after a release; DUE: at the ground, its impact is applied after the release of another foot.
enum Departure { DUE = -1, UNDER_WAY = 0, RISING = 1, FROM_REST = 2 };

struct Foot : Grip {
  double from = 0.0, base = 0.0;  // gap [m] at which its film's momentum counts as 0, and what it is there [N s]
  double momentum = 0.0;  // [N s] of its film, by the gap, with which the next step begins
  double left = -INF;  // [s] when its pull last exceeded the strength of a contact
  double rose = 0.0;   // [s] when it last came to the ground or left it
  double speeds = 0.0, places = 0.0;  // [m/s], [m] largest sums of the sizes of the terms of its rate and gap at this time
  double slides = 0.0;                // [m/s] and to its rate along the ground
  double forces = 0.0;                // [N] and to the pull on it where it is held, or would be
  int low = 0;         // flights in a row that are lost in the error of a step
  int departure = UNDER_WAY;
  // along the ground: the place at which it sticks [m]; the direction in which it slides (+-1), 0 without friction; how a slide
  // begins, as a Departure
  double place = 0.0, sense = 0.0;
  int slide = UNDER_WAY;
  Apex apex;
};

// Node intervals (tau[j - 1], tau[j]] in which a foot may have an event: first to last; last 0: none. at: its scaled time; zero:
// `no_margin` of the foot once it was asked for.
struct UnresolvedRoot {
  int first = N, last = 0;
  double at = 2.0, zero = 0.0;
};

// Longer steps that were rejected. The estimate of the next step's error assumes a truncation that goes with h^9, which fails
// where a film bends within a step, and where a foot hovers so close to the ground that a long step cannot exclude a landing.
// Each time that a longer step is rejected again, twice as many steps pass before the next trial.
struct Refused {
  static constexpr int MOST_WAIT = 31;
  int k = -1, wait = 0, left = 0, since = 0;  // the shortest class refused; steps to wait, and left of them; steps since then

  void refuse(int by) {
    const bool again = k >= 0 && since <= 2 * wait + 2;
    wait = again ? std::min(2 * wait + 1, MOST_WAIT) : 0;
    k = again ? std::max(k, by) : by;
    left = wait;
    since = 0;
  }
  // The class to try in place of ``wanted``, after a step of class ``last``.
  int next(int wanted, int last) {
    since++;
    if (last <= k) *this = {};
    if (wanted > k || left == 0) return wanted;
    left--;
    return k + 1;
  }
};

// Observes a run: notified of each accepted step. The state at its start is Modal::ahead then, its inputs are
// Modal::values.
struct StepObserver {
  // step: from ``begun`` [s] to its scaled time ``fraction``.
  virtual void accepted(const StepClass& step, double begun, double fraction) = 0;

 protected:
  ~StepObserver() = default;
};

struct Modal {
  Book& book;
  const Sizes sizes;
  const Nodes& nodes;
  const Settings units;  // tolerances for a length and a force of one
  Settings settings;     // and those of the run
  ActingLaws laws;
  Player player;
  Clock clock;
  Log log;
  StepObserver* observer = nullptr;
  double ended = NOT_A_NUMBER;  // scaled time at which the last step ended, of which ``values`` are; not a number after another contact mode was entered
  std::vector<Foot> feet;
  Bias biases;

  const ContactMode *mode = nullptr, *next = nullptr;  // the one a run is in, and the one it enters
  BiasMode* bias = nullptr;                            // what rest gaps and gravity do in it
  const BiasStep* bias_step = nullptr;                 // and in the step being made
  int step_class = 0;
  int last_launch = 0;     // class that the film allowed at the last start
  bool launching = false;  // the first step in a contact mode
  Refused refused;
  bool check = true;       // contacts may be due at this very moment
  bool strong = false;     // films' momenta count from where a step begins: see rebase
  bool entering = true;    // ``next`` is to be entered with the state ``physical``
  std::vector<double> physical, from_offset;

  // a step: values of the inputs at the nodes, volts at the feet; outputs without smooth forces, and with them
  std::vector<Row> values, volts, linear, outputs, margin;
  std::vector<Row> flowing;  // outputs without friction and smooth forces
  std::vector<uint8_t> constant;  // per input
  std::vector<int> acting;        // inputs that act in this contact mode: smooth forces of free feet, drives
  std::vector<int> inputs;        // the same, then friction of feet that slide, and the places of those that stick
  std::vector<int> braked;        // feet that slide with friction
  std::vector<uint8_t> frictional;  // whether a foot has a direction along the ground, and a friction that is not zero
  std::vector<int> stopping;      // feet that have come to a stop in their slides, and stick now unless the pull exceeds their friction
  std::vector<int> happening;     // events at the end of the step, as `events` counts them
  bool jammed = false;            // friction has no solution: see modal/friction.hpp
  std::vector<double> room;       // of a foot to where its film is infinite [m]; negative: see runs_deep
  std::vector<double> gaps;       // [m]
  std::vector<UnresolvedRoot> unresolved;
  double film_now = NOT_A_NUMBER;  // one foot's film at the start of the step, where the last one has left it
  double noted = -INF;             // [s] the moment of `Foot::speeds`, `places`, `slides` and `forces`
  double rounding = 0.0;           // [m] of the gaps of feet in strong films, excluded from the error of a step
  double growth_before = 1.0, growth_after = 1.0;  // of the smooth force that makes the error, over the step
  bool steady = true;                              // drives and volts are constant over the step
  int64_t filled = -1;                             // state of the player for which they hold constants
  double per_gap, per_drive;                       // one over what an error may be
  double chord[N];  // of each node interval: its width over the widest, squared, by which bounds of chords go

  // landing: Taylor coefficients of an output (zeros behind), inputs by powers of time, those times StepClass::share
  alignas(64) double line[TERMS + 3 * N] = {};
  alignas(64) double pull_line[TERMS + 3 * N] = {};  // of the pull that bears friction
  alignas(64) double scaled_times[TERMS] = {};
  std::vector<Row> powers, shares, volt_powers;
  int degree = 1;

  std::vector<double> matrix;  // of Newton's method
  // Where feet follow others (see ContactMode::leading): the smooth inputs of the leading feet with the shares of all others,
  // and work space; in every contact mode the inputs that sweeps go through, and whether a law of any takes gap rates.
  std::vector<Row> collected, moved, slopes;
  std::vector<int> pushing;
  bool rated = false;

  Modal(Book& b, const Nodes& n, const Signals& signals, const Laws& l, const Settings& s, size_t channels)
      : book(b), sizes(b.sizes), nodes(n), units(s), settings(s), laws(l), player(signals, n, channels), feet(sizes.feet),
        biases(sizes, b.classes()), physical(2 * sizes.coordinates), from_offset(2 * sizes.coordinates),
        values(sizes.inputs(), Row(0.0)),
        volts(sizes.feet, Row(0.0)), linear(2 * sizes.feet, Row(0.0)), outputs(2 * sizes.feet, Row(0.0)),
        margin(events(), Row(0.0)), constant(sizes.inputs(), 0), frictional(sizes.feet, 0), room(sizes.feet), gaps(sizes.feet),
        unresolved(events()), per_gap(1.0 / s.gap), per_drive(1.0 / s.drive), powers(sizes.inputs(), Row(0.0)), shares(sizes.inputs(), Row(0.0)),
        volt_powers(sizes.feet, Row(0.0)), collected(2 * sizes.feet, Row(0.0)), moved(sizes.feet, Row(0.0)), memory_(4 * rows(), Row(0.0)), state_(numbers(0)), ahead_(numbers(1)),
        chain_(numbers(2)) {
    constexpr double WIDEST_INTERVAL = 0.2092;  // of the node intervals, in scaled time
    for (int j = 1; j < N; j++) {
      chord[j] = (n.tau[j] - n.tau[j - 1]) * (n.tau[j] - n.tau[j - 1]) / (WIDEST_INTERVAL * WIDEST_INTERVAL);
    }
    values[sizes.last()] = Row(1.0);
    constant[sizes.last()] = 1;
  }

  // Number of event functions: for every foot that it reaches or leaves the ground, and then, where feet have a direction along it,
  // that it slides forward or stops, and that it slides backward.
  int events() const { return sizes.feet + 2 * sizes.ways; }

  // Age [s] that a contact of a foot would begin with now.
  double age_brought(int foot) const { return feet[foot].brought(laws, foot, clock.time); }
  // Whether a foot's pull has exceeded the strength of its contact at the present time.
  bool just_released(int foot) const { return clock.time - feet[foot].left <= settings.least_progress; }

  // Flowing state (2 stride): the modal state less beta P of the film momenta; and the one at the end of a step.
  TARSUS_INLINE double* state() { return state_; }
  TARSUS_INLINE const double* state() const { return state_; }
  TARSUS_INLINE double* ahead() { return ahead_; }
  TARSUS_INLINE double* chain() { return chain_; }  // room for two states
  void accept() { std::swap(state_, ahead_); }

  // A step of one class in the present contact mode, with the effect of rest gaps and gravity in it.
  TARSUS_INLINE const StepClass& take_class(int k) {
    const StepClass& step = book.step(*mode, k);
    bias_step = &biases.of(*bias, step);
    return step;
  }

  TARSUS_INLINE const double* value(int input) const { return reinterpret_cast<const double*>(&values[input]); }
  TARSUS_INLINE double* value(int input) { return reinterpret_cast<double*>(&values[input]); }

  double along(const double* rows, int row) const { return dot(rows + row * sizes.state(), state()); }
  double gap_of(int foot) const { return along(mode->outputs, foot) + bias->feed[foot] + of_places(foot); }
  // Effect of the places at which feet stick on an output.
  double of_places(int output) const {
    double sum = 0.0;
    for (int k : mode->stuck) sum += mode->feed[output * sizes.inputs() + sizes.feet + k] * feet[k].place;
    return sum;
  }
  double rate_of(int foot) const { return along(mode->outputs, sizes.feet + foot); }
  // Sum of the sizes of the terms of a row times the state.
  double parts(const double* rows, int row) const {
    const double *r = rows + row * sizes.state(), *w = state();
    double even = 0.0, odd = 0.0;  // state() is even
    for (int k = 0; k < sizes.state(); k += 2) {
      even += std::fabs(r[k] * w[k]);
      odd += std::fabs(r[k + 1] * w[k + 1]);
    }
    return even + odd;
  }
  double gap_parts(int foot) const { return parts(mode->outputs, foot) + std::fabs(bias->feed[foot]); }
  double rate_parts(int foot) const { return parts(mode->outputs, sizes.feet + foot); }
  // Sum of the sizes [N] of the terms of the force on a held foot, by output: normal to the ground or along it.
  double force_parts(int output) const {
    double sum = parts(mode->outputs, output) + std::fabs(bias->feed[output]);
    for (int i : inputs) sum += std::fabs(mode->feed[output * sizes.inputs() + i] * value(i)[0]);
    return sum;
  }
  // Whether what is noted of the feet is of the present moment.
  bool just_noted() const { return clock.time - noted <= settings.least_progress; }
  void begin_notes() {
    if (just_noted()) return;
    noted = clock.time;
    for (Foot& foot : feet) foot.speeds = foot.places = foot.slides = foot.forces = 0.0;
  }
  // Note the sums of the sizes of the terms of the feet's gaps, rates and pulls, which bound the rounding that an impact, or a
  // change of the contact mode, leaves. A single foot is not asked for them again before it has moved.
  void note_parts() {
    if (sizes.feet == 1 && sizes.ways == 0) return;
    begin_notes();
    for (int i = 0; i < sizes.ways; i++) feet[i].slides = std::max(feet[i].slides, parts(mode->slide_rate, i));
    for (int i : mode->held) feet[i].forces = std::max(feet[i].forces, force_parts(i));
    for (int i : mode->free) {
      feet[i].speeds = std::max(feet[i].speeds, rate_parts(i));
      feet[i].places = std::max(feet[i].places, gap_parts(i));
    }
  }
  // Bounds below which the gap [m] and the rate [m/s] of a free foot count as zero: by the scales of the scene, or their rounding.
  double no_gap(int foot) const { return settings.gap_zero + ROUNDING * std::max(feet[foot].places, gap_parts(foot)); }
  double no_rate(int foot) const {
    double parts = std::max(feet[foot].speeds, rate_parts(foot));
    if (strong) {  // the rounding of the gap is one of the film's momentum, and so of the speed that the film takes
      for (int k : mode->free) {
        if (!laws.has(k, HAS_MOMENTUM)) continue;
        const double taken = mode->feed[(sizes.feet + foot) * sizes.inputs() + k] * laws.momentum_slope(k, std::max(gaps[k], 0.0), settings.probe);
        parts += std::fabs(taken) * std::max(feet[k].places, gap_parts(k));
      }
    }
    return settings.speed_zero + ROUNDING * parts;
  }

  void shift(const double* rows, int row, double by) {
    const double* r = rows + row * sizes.state();
    double* w = state();
    for (int i = 0; i < sizes.state(); i++) w[i] += r[i] * by;
  }

  // Momentum [N s] of a foot's film at a gap, from that at its base on.
  template <class Real>
  TARSUS_INLINE Real film(int foot, const Real& gap) const {
    return strong ? laws.momentum_from(foot, feet[foot].from, feet[foot].base, gap) : laws.momentum(foot, gap);
  }
  // Count film momenta from the present gaps (``gaps``), which shifts the flowing state and changes nothing else: a small
  // motion in a strong film would otherwise be a difference of large numbers.
  void rebase() {
    for (int i : mode->free) {
      if (!laws.has(i, HAS_MOMENTUM)) continue;
      feet[i].from = gaps[i];
      feet[i].base = laws.momentum(i, gaps[i]);
    }
  }

  // Momentum of a film at a scaled time of the last step, by the polynomial of its change, which has the least rounding.
  double momentum_at(int foot, double s) const {
    if (s == 1.0) return values[foot][N - 1];
    const Row change = values[foot] - values[foot][0], powers = powers_of(nodes, reinterpret_cast<const double*>(&change));
    return values[foot][0] + horner(reinterpret_cast<const double*>(&powers), 0, N, s);
  }

  double strength_now(int foot) const { return laws.strength(foot, clock.time - feet[foot].since, volts_now(foot)); }
  void set_mode(const ContactMode& to) {
    mode = &to;
    bias = &biases.of(to);
  }
  double force_now(int foot, double gap, double rate) const {
    return laws.force(foot, gap, rate, volts_now(foot), clock.time);
  }
  double volts_now(int foot) const { return foot_volts(foot, clock.time); }

  double foot_volts(int foot, double t) const {
    const int64_t c = laws.laws.volts[foot];
    return c < 0 ? 0.0 : player.value(int(c), t);
  }

  // Values of drives and volts at the nodes of the step [t, t + h].
  TARSUS_INLINE void drive(double t, double h) {
    if (filled == player.moves && t + h <= player.flat_until) return;  // unchanged
    steady = true;
    for (int d = 0; d < sizes.drives; d++) {
      const int i = 2 * sizes.feet + d;
      constant[i] = player.fill(d, t, h, value(i));
      steady = steady && constant[i];
    }
    for (int i = 0; i < sizes.feet; i++) {
      const int64_t c = laws.laws.volts[i];
      if (c >= 0) steady = player.fill(int(c), t, h, reinterpret_cast<double*>(&volts[i])) && steady;
    }
    filled = steady ? player.moves : -1;
  }

 private:
  std::vector<Row> memory_;
  double *state_, *ahead_, *chain_;

  int rows() const { return (sizes.state() + N - 1) / N; }
  double* numbers(int state) { return reinterpret_cast<double*>(memory_.data() + state * rows()); }
  double dot(const double* a, const double* b) const {
    double sum = 0.0;
    for (int i = 0; i < sizes.state(); i++) sum += a[i] * b[i];
    return sum;
  }
};

}  // namespace tarsus::modal
