// What the data of a run determine before it begins: where a walker stands, and the length and force that tolerances refer to.
#pragma once
#include "base/fields.hpp"
#include "march/batch.hpp"
#include "laws/laws.hpp"
#include "drives/signals.hpp"

namespace tarsus {

constexpr double SMALLEST = 1e-12;  // [m] below the size of an atom a clearance is zero and no scale
// Smallest part of a run's largest length that tolerances may refer to: 1e-10 of it is 1e-13 of a far foot's gap then, whose
// rounding is 1e-16 of that.
constexpr double NEAREST = 1e-3;
constexpr double NO_LENGTH = 1e-6, NO_FORCE = 1e-9;  // [m], [N] where nothing says how long or how strong
constexpr double BELOW = 1e-12;     // part of a rest gap and of a displacement that their sum's rounding is far below
constexpr double BALANCED = 1e-9;   // forces below this part of the largest are rounding

enum Fault { BELOW_GROUND, PULLED_DOWN, UNBALANCED };

// Why a run cannot start; foot: or -1; by: how far below the ground [m], or the force [N] by which it would have to be held.
struct Refusal {
  double run, fault, foot, by;
};

// The data of one run, with its initial state and its scales to be filled in; idle: forces (drives,) [N] without volts.
struct Starting {
  const double *parameters, *sources, *idle;
  const int64_t* channels;
  double *initial, *scales;
};

// Of one plan. normals (n, m), stiffness (n, n), weight (n, 2) per unit of gravity, loads (n, nd): of the structure. stance
// (n, m + 2 + nd): where a walker stands, per unit of rest gaps, gravity and forces of the drives, and empty where runs start
// otherwise; heights (m,): coordinates of the feet upward, ways (m,): along the ground, where friction holds them; loose: those of
// other parts that nothing holds; driven: whether it stands under the first volts.
struct StartRules {
  std::vector<double> normals, stiffness, weight, loads, stance;
  std::vector<int> heights, ways, loose;
  bool driven = false;
  size_t n = 0, m = 0, drives = 0;

  explicit StartRules(const Fields& from)
      : normals(from.doubles("normals")), stiffness(from.doubles("stiffness")), weight(from.doubles("weight")),
        loads(from.doubles("loads")), stance(from.doubles("stance")), heights(from.narrowed<int>("heights")),
        ways(from.narrowed<int>("ways")), loose(from.narrowed<int>("loose")), driven(from.whole("driven") != 0),
        n(weight.size() / GRAVITIES), m(size_t(from.whole("feet"))),
        drives(size_t(from.whole("drives"))) {
    Fields::check("normals", normals.size() == n * m);
    Fields::check("stiffness", stiffness.size() == n * n);
    Fields::check("loads", loads.size() == n * drives);
    Fields::check("stance", stance.empty() || (stance.size() == n * (m + GRAVITIES + drives) && heights.size() == m && ways.size() == m));
    for (const std::vector<int>* places : {&heights, &ways, &loose}) {
      for (int at : *places) Fields::check("stance", at >= 0 && size_t(at) < n);
    }
    for (double w : weight) heaviest = std::max(heaviest, std::fabs(w));
    softest = n > 0 ? INF : 0.0;
    for (size_t r = 0; r < n; r++) softest = std::min(softest, std::fabs(stiffness[r * n + r]));
  }

  bool stands() const { return !stance.empty(); }

  // Where a foot's gap begins [m].
  double gap(const Starting& run, size_t foot) const { return run.sources[foot] + moved(run, foot); }

  // Set a walker on its feet.
  void stand(const Starting& run, const Signals& signals) const {
    const size_t width = m + GRAVITIES + drives;
    std::vector<double> given(run.sources, run.sources + m + GRAVITIES);
    for (size_t d = 0; d < drives; d++) given.push_back(force(run, signals, d));
    for (size_t r = 0; r < n; r++) {
      double sum = 0.0;
      for (size_t c = 0; c < width; c++) sum += stance[r * width + c] * given[c];
      run.initial[r] = sum;
    }
  }

  // Feet of a standing walker that would have to be held down, and forces along the way that neither springs nor friction balance.
  void check_stance(const Starting& run, const Signals& signals, ActingLaws& laws, double number, std::vector<Refusal>& out) const {
    laws.take(run.parameters);
    std::vector<double> push(n);  // of the structure on what holds it
    double loaded = 0.0, sprung = 0.0;
    for (size_t r = 0; r < n; r++) {
      double load = 0.0, spring = 0.0;
      for (size_t g = 0; g < GRAVITIES; g++) load += weight[GRAVITIES * r + g] * run.sources[m + g];
      for (size_t d = 0; d < drives; d++) load += loads[r * drives + d] * force(run, signals, d);
      for (size_t c = 0; c < n; c++) spring += stiffness[r * n + c] * run.initial[c];
      push[r] = spring - load;
      loaded = std::max(loaded, std::fabs(load));
      sprung = std::max(sprung, std::fabs(spring));
    }
    const double rounding = BALANCED * (loaded + sprung);
    double along = 0.0;
    for (int way : loose) along = std::max(along, std::fabs(push[way]));
    for (size_t i = 0; i < m; i++) {
      const int64_t channel = laws.laws.volts[i];
      const double volts = driven && channel >= 0 ? at_begin(signals, run.channels[channel]) : 0.0;
      const double attraction = laws.force(int(i), 0.0, 0.0, volts, 0.0);
      const double strength = laws.strength(int(i), 0.0, volts), hold = push[heights[i]] + strength - attraction;
      if (hold < -rounding) out.push_back({number, double(PULLED_DOWN), double(i), -hold});
      along = std::max(along, std::fabs(push[ways[i]]) - laws.friction(int(i), std::max(hold, 0.0), strength, 0.0));
    }
    if (along > rounding) out.push_back({number, double(UNBALANCED), -1.0, along});
  }

  void check_gaps(const Starting& run, double number, std::vector<Refusal>& out) const {
    for (size_t i = 0; i < m; i++) {
      const double begins = gap(run, i);
      if (begins < -BELOW * std::max(run.sources[i], std::fabs(moved(run, i)))) {
        out.push_back({number, double(BELOW_GROUND), double(i), -begins});
      }
    }
  }

  // The length is the least rest gap that is any, and not below NEAREST of the largest length: a foot a millimetre away, or a film as
  // thick, says nothing of how exactly one must be known that works within a micrometre.
  void set_scales(const Starting& run, const Signals& signals, const Laws& laws) const {
    double length = laws.scale(Laws::LENGTH, run.parameters), nearest = INF;
    for (size_t i = 0; i < m; i++) {
      length = std::max({length, std::fabs(gap(run, i)), run.sources[i]});
      if (run.sources[i] > SMALLEST) nearest = std::min(nearest, run.sources[i]);
    }
    if (!(length > SMALLEST)) length = NO_LENGTH;
    const double near = std::min(std::max(nearest, NEAREST * length), length);
    // by what moves a foot as far as that: a thick film, or a foot far away, makes no force
    double most = std::max({laws.scale(Laws::STRENGTH_OF_LAW, run.parameters), std::hypot(run.sources[m], run.sources[m + 1]) * heaviest, near * softest});
    for (size_t d = 0; d < drives; d++) most = std::max(most, signals.span[run.channels[d]]);
    run.scales[0] = near;
    run.scales[1] = most > 0.0 ? most : NO_FORCE;
  }

 private:
  double heaviest = 0.0, softest = 0.0;  // [kg], [N/m]

  double moved(const Starting& run, size_t foot) const {
    double sum = 0.0;
    for (size_t r = 0; r < n; r++) sum += run.initial[r] * normals[r * m + foot];
    return sum;
  }
  double force(const Starting& run, const Signals& signals, size_t d) const {
    return driven ? at_begin(signals, run.channels[d]) : run.idle[d];
  }
  static double at_begin(const Signals& signals, int64_t channel) {
    const double* term = signals.coef.data() + DEGREE * signals.first[channel];
    double sum = 0.0;
    for (int k = DEGREE - 1; k >= 0; k--) sum = term[k] - sum;  // at the left end of the piece
    return sum;
  }
};

// Fill in one run; what it cannot start with is added to ``refused``.
inline void set_up(const StartRules& rules, ActingLaws& laws, const Signals& signals, const Starting& run, double number,
                   std::vector<Refusal>& refused) {
  if (rules.stands()) {
    rules.stand(run, signals);
    rules.check_stance(run, signals, laws, number, refused);
  }
  rules.check_gaps(run, number, refused);
  rules.set_scales(run, signals, laws.laws);
}

}  // namespace tarsus
