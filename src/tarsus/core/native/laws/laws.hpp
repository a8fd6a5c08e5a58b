// What acts between a foot and the ground: seven functions of plain numbers, each a sum of terms.
//
// A term is a law: one of the twins written here in C++ (the law files of tarsus.model.laws are their only other home, and a
// conformance test compares the two), or the program made of a law's plain Python. The parameters of a foot are one row; a term
// has the column at which its own begin. The list of terms is data, so a new law needs no change here.
#pragma once
#include <algorithm>
#include <vector>

#include "laws/program.hpp"

namespace tarsus {

enum Hook { MOMENTUM, FORCE, REBOUND, STRENGTH, FRICTION, EXCESS, REMAINING, HOOKS };

// Arguments of a friction law's bound. One that takes the first two alone does not depend on the slip speed.
enum FrictionArgument { MARGIN, HELD_STRENGTH, SLIP_SPEED, FRICTION_ARGUMENTS };

enum Twin {
  NO_TWIN = -1,
  FILM_MOMENTUM,
  ELECTROSTATIC_FORCE,
  LEG_ELECTROSTATIC_FORCE,
  RESTITUTION_REBOUND,
  ADHESION_STRENGTH,
  FRICTION_BOUND,
  ADHESIVE_FRICTION_BOUND,
  RESTITUTE_FIRST_EXCESS
};

enum LawFlag {
  HAS_MOMENTUM = 1,
  HAS_FORCE = 2,
  USES_RATE = 4,
  HAS_LATCH = 8,
  MAP_AS_IS = 16,         // the impact law acts as it is, not through its passive projection
  RESTITUTES_FIRST = 32,  // landing rules; with neither a foot is captured unless pulled
  PULL_AS_PRINTED = 64
};

// Factors of what the laws say under a foot, of the ground below it.
struct Patch {
  double rebound = 1.0, strength = 1.0, friction = 1.0;
};

// A twin or the number of a program; the first column of its parameters, and of what a program makes of them.
struct Term {
  int twin = NO_TWIN, program = -1, first = 0, fixed = 0;
};

// Momentum [N s] of a squeeze film at a gap [m]: C / 2 (g + g0)^2.
template <class Real>
TARSUS_INLINE Real film_momentum(const Real& gap, double coefficient, double thickness) {
  const Real distance = gap + thickness;
  return (0.5 * coefficient) / (distance * distance);
}

// The same less its value ``base`` [N s] at the gap ``from``.
template <class Real>
TARSUS_INLINE Real film_momentum_from(double from, double base, const Real& gap, double thickness) {
  const Real distance = gap + thickness;
  return (from - gap) * (gap + (from + 2.0 * thickness)) * base / (distance * distance);
}

// Attraction [N] along a leg that turns about its hip.
inline double leg_attraction(double gap, double volts, double coefficient, double offset, double rest) {
  if (coefficient == 0.0) return 0.0;
  const double height = offset + rest, x = (gap - rest) / height;
  double share = 0.0;
  if (std::fabs(x) < 0.02) {  // series of [ln(1 + x) - x / (1 + x)] / x^2, to 1e-15
    for (int n = 11; n > 1; n--) share = -x * share + (n - 1.0) / n;
  } else {
    share = (std::log(1.0 + x) - x / (1.0 + x)) / (x * x);
  }
  return -coefficient * volts * volts * share / (height * height);
}

// The laws of all feet of one plan; shared by its runs.
struct Laws {
  int feet = 0, columns = 0;
  std::vector<int64_t> flags, volts;  // per foot; volts: channel of its electrode, or -1
  std::vector<Term> terms[HOOKS];
  std::vector<Program> programs;
  int fixed = 0, registers = 0;  // room for the fixed values of all programs of a foot; most registers of a program
  bool friction_by_speed = false;  // whether the law of friction takes the slip speed; it is a program then

  // Lengths over which laws change and forces that they exert, each a sum of parameters; a length [m] and a force [N]
  // besides those of the structure.
  enum Dimension { LENGTH, STRENGTH_OF_LAW };
  struct Scale {
    int dimension;
    std::vector<int> columns;
  };
  std::vector<Scale> scales;

  // The largest of them for the parameters of a run, as those of its first foot say; 0 where there is none.
  double scale(Dimension of, const double* parameters) const {
    double most = 0.0;
    for (const Scale& one : scales) {
      double sum = 0.0;
      for (int column : one.columns) sum += parameters[column];
      if (one.dimension == of) most = std::max(most, sum);
    }
    return most;
  }

  void add(int hook, Term term) {
    if (term.program >= 0) {
      const Program& program = programs.at(term.program);
      term.fixed = fixed;
      fixed += program.fixed();
      registers = std::max(registers, program.registers());
      friction_by_speed |= hook == FRICTION && program.arguments > SLIP_SPEED;
    }
    terms[hook].push_back(term);
  }
};

// The laws as one run sees them: with the parameters of that run.
struct ActingLaws {
  const Laws& laws;
  const double* parameters = nullptr;  // (feet, columns)
  std::vector<double> fixed;           // (feet, laws.fixed): what programs make of them, see ``take``
  mutable std::vector<Row> rows;
  mutable std::vector<double> numbers;
  mutable std::vector<Dual<1>> sloping;
  mutable std::vector<Dual<FRICTION_ARGUMENTS>> sliding;

  explicit ActingLaws(const Laws& l)
      : laws(l), fixed(l.feet * l.fixed), rows(l.registers), numbers(l.registers), sloping(l.registers), sliding(l.registers) {}

  // The parameters (feet, columns) of a run, which stay where they are as long as it lasts.
  void take(const double* given) {
    parameters = given;
    for (const auto& terms : laws.terms) {
      for (const Term& term : terms) {
        if (term.program < 0) continue;
        for (int i = 0; i < laws.feet; i++) prepare(laws.programs[term.program], of(i, term), fixed_of(i, term));
      }
    }
  }

  bool has(int foot, int flag) const { return (laws.flags[foot] & flag) != 0; }
  const double* of(int foot, const Term& term) const { return parameters + foot * laws.columns + term.first; }

  // The film alone makes momentum: the law that the innermost loops may write out.
  bool film_alone() const { return laws.terms[MOMENTUM].size() == 1 && laws.terms[MOMENTUM][0].twin == FILM_MOMENTUM; }
  // The strength grows linearly with age: Adhesion alone, or none.
  bool linear_strength() const {
    return laws.terms[STRENGTH].empty() ||
           (laws.terms[STRENGTH].size() == 1 && laws.terms[STRENGTH][0].twin == ADHESION_STRENGTH);
  }

  // Whether the strength goes by volts.
  bool commanded() const {
    const auto& terms = laws.terms[STRENGTH];
    return !terms.empty() && terms[0].program >= 0 && laws.programs[terms[0].program].arguments > 1;
  }

  // Momentum [N s] at a gap [m]; the force on the foot is its rate of change. ``Real`` is double or Row. A law is
  // promised to be finite on the ground and above; below, where a step's trial may reach, its value on the ground
  // stands for one that is not.
  template <class Real>
  TARSUS_INLINE Real momentum(int foot, const Real& gap) const {
    Real sum = Real(0.0);
    for (const Term& term : laws.terms[MOMENTUM]) sum += momentum_of(term, foot, gap);
    return on_ground(sum, gap, [&] { return momentum(foot, 0.0); });
  }

  // The momentum less ``base``, its value at the gap ``from``: to their difference's own rounding where the film is alone, or
  // where the difference is small (see slight_difference).
  template <class Real>
  TARSUS_INLINE Real momentum_from(int foot, double from, double base, const Real& gap) const {
    if (film_alone()) return film_momentum_from(from, base, gap, of(foot, laws.terms[MOMENTUM][0])[1]);
    return slight_difference(foot, from, base, gap);
  }

  // The momentum of one law.
  template <class Real>
  TARSUS_INLINE Real momentum_of(const Term& term, int foot, const Real& gap) const {
    const double* p = of(foot, term);
    return term.twin == FILM_MOMENTUM ? film_momentum(gap, p[0], p[1]) : by_program(foot, term, &gap);
  }

  // Derivative of the momentum by the gap [N s/m]; by central differences over a probe [m] where a program has none.
  template <class Real>
  Real momentum_slope(int foot, const Real& gap, double probe) const {
    if (film_alone()) {
      const double* p = of(foot, laws.terms[MOMENTUM][0]);
      return -2.0 * film_momentum(gap, p[0], p[1]) / (gap + p[1]);
    }
    const Real slope = program_slope(foot, gap);
    if (finite(slope)) return slope;
    return (momentum(foot, gap + probe) - momentum(foot, gap - probe)) / (2.0 * probe);
  }

  // Smooth force [N] along the normal.
  template <class Real>
  Real force(int foot, const Real& gap, const Real& rate, const Real& volts, const Real& time) const {
    Real sum = Real(0.0);
    for (const Term& term : laws.terms[FORCE]) sum += force_of(term, foot, gap, rate, volts, time);
    return on_ground(sum, gap, [&] { return ground_force(foot, rate, volts, time); });
  }

  // The smooth force of one law.
  template <class Real>
  TARSUS_INLINE Real force_of(const Term& term, int foot, const Real& gap, const Real& rate, const Real& volts,
                              const Real& time) const {
    const double* p = of(foot, term);
    if (term.twin == ELECTROSTATIC_FORCE) {
      const Real distance = gap + p[1];
      return -p[0] * (volts * volts) / (distance * distance);
    }
    if (term.twin == LEG_ELECTROSTATIC_FORCE) return along_leg(gap, volts, p);
    const Real arguments[4] = {gap, rate, volts, time};
    return by_program(foot, term, arguments);
  }

  // Number of laws whose part of the work is integrated: all but one of the resistive laws and all but one of the smooth ones. The
  // part of the one that is left is the rest of the sum.
  size_t shares() const {
    const size_t resistive = laws.terms[MOMENTUM].size(), smooth = laws.terms[FORCE].size();
    return (resistive > 0 ? resistive - 1 : 0) + (smooth > 0 ? smooth - 1 : 0);
  }

  // Speed [m/s] of departure after an impact.
  double rebound(int foot, double speed) const {
    double out = 0.0;
    for (const Term& term : laws.terms[REBOUND]) {
      const double* p = of(foot, term);
      out += term.twin == RESTITUTION_REBOUND ? p[0] * speed : by_program(foot, term, &speed);
    }
    return out;
  }

  // Largest pull [N] that a contact of a given age [s] holds under the volts of its foot.
  template <class Real>
  Real strength(int foot, const Real& age, const Real& volts) const {
    Real sum = Real(0.0);
    const Real arguments[2] = {age, volts};
    for (const Term& term : laws.terms[STRENGTH]) {
      const double* p = of(foot, term);
      sum += term.twin == ADHESION_STRENGTH ? p[0] + p[1] * age : by_program(foot, term, arguments);
    }
    return sum;
  }

  // Age [s] that a contact keeps of the age [s] of the one before, after a time in the air [s]; 0 where no law defines it.
  double remaining(int foot, double age, double away) const {
    double sum = 0.0;
    const double arguments[2] = {age, away};
    for (const Term& term : laws.terms[REMAINING]) sum += by_program(foot, term, arguments);
    return sum;
  }

  // Largest friction force [N] of a contact of strength ``held`` = f_a [N] and margin N + f_a [N], at a slip speed [m/s] >= 0. At
  // speed 0 it is the largest force along the ground under which the foot sticks. ``Real`` is double, Row, or a Dual at the
  // nodes by the arguments.
  template <class Real>
  Real friction(int foot, const Real& margin, const Real& held, const Real& speed) const {
    Real sum = Real(0.0);
    for (const Term& term : laws.terms[FRICTION]) {
      const double* p = of(foot, term);
      if (term.twin == FRICTION_BOUND) {
        sum = sum + margin * p[0];
      } else if (term.twin == ADHESIVE_FRICTION_BOUND) {
        sum = sum + held * p[0];
      } else {
        const Real arguments[FRICTION_ARGUMENTS] = {margin, held, speed};
        sum = sum + by_program(foot, term, arguments);
      }
    }
    return sum;
  }

  // Speed of departure [m/s] above the largest one at which a foot may be held.
  double excess(int foot, double departing) const {
    double out = 0.0;
    for (const Term& term : laws.terms[EXCESS]) {
      const double* p = of(foot, term);
      out += term.twin == RESTITUTE_FIRST_EXCESS ? departing - p[0] : by_program(foot, term, &departing);
    }
    return out;
  }

 private:
  // Derivative of the momentum by the gap, from derivatives of its laws.
  TARSUS_APART Row program_slope(int foot, const Row& gap) const {
    Dual<1> sum(Row(0.0));
    const Dual<1> at = Dual<1>::variable(gap, 0);
    for (const Term& term : laws.terms[MOMENTUM]) {
      const double* p = of(foot, term);
      sum = sum + (term.twin == FILM_MOMENTUM ? (0.5 * p[0]) / squared(at + p[1]) : value_of(foot, term, &at, sloping.data()));
    }
    return sum.slope[0];
  }
  double program_slope(int foot, double gap) const { return program_slope(foot, Row(gap))[0]; }

  // The momentum less its value ``base`` at the gap ``from``. Where that difference is SLIGHT_PART of the base or more it is taken
  // plainly. A smaller one is the integral of the momentum's slope by two Gauss points, whose rounding is that of the slope and
  // whose truncation is 1e-13 of the difference for a power of the gap. Where the two differ by more than DIFFERENCE_ROUNDING
  // of the base, the rounding of the plain one, the law bends between the two gaps and the plain one stands.
  static constexpr double SLIGHT_PART = 1e-3, DIFFERENCE_ROUNDING = 1e-14, GAUSS_PLACE = 0.57735026918962576;  // 1 / sqrt(3)
  TARSUS_APART Row slight_difference(int foot, double from, double base, const Row& gap) const {
    const Row plain = momentum(foot, gap) - base;
    if (any_less(Row(SLIGHT_PART * std::fabs(base)), magnitude(plain))) return plain;
    const Row half = (gap - from) * 0.5, middle = half + from, aside = half * GAUSS_PLACE;
    const Row found = half * (program_slope(foot, middle - aside) + program_slope(foot, middle + aside));
    return any_not_below(magnitude(found - plain), Row(DIFFERENCE_ROUNDING * std::fabs(base))) ? plain : found;
  }
  double slight_difference(int foot, double from, double base, double gap) const {
    return gap == from ? 0.0 : slight_difference(foot, from, base, Row(gap))[0];
  }

  double* fixed_of(int foot, const Term& term) { return fixed.data() + foot * laws.fixed + term.fixed; }
  TARSUS_APART double by_program(int foot, const Term& term, const double* arguments) const {
    return value_of(foot, term, arguments, numbers.data());
  }
  TARSUS_APART Row by_program(int foot, const Term& term, const Row* arguments) const {
    return value_of(foot, term, arguments, rows.data());
  }
  TARSUS_APART Dual<FRICTION_ARGUMENTS> by_program(int foot, const Term& term, const Dual<FRICTION_ARGUMENTS>* arguments) const {
    return value_of(foot, term, arguments, sliding.data());
  }
  template <class Real>
  TARSUS_INLINE Real value_of(int foot, const Term& term, const Real* arguments, Real* registers) const {
    const Program& program = laws.programs[term.program];
    for (int i = 0; i < program.arguments; i++) registers[i] = arguments[i];
    return evaluate(program, fixed.data() + foot * laws.fixed + term.fixed, registers);
  }
  static double along_leg(double gap, double volts, const double* p) { return leg_attraction(gap, volts, p[0], p[1], p[2]); }
  static Row along_leg(const Row& gap, const Row& volts, const double* p) {
    return each(gap, volts, [p](double g, double v) { return leg_attraction(g, v, p[0], p[1], p[2]); });
  }
  double ground_force(int foot, double rate, double volts, double time) const { return force(foot, 0.0, rate, volts, time); }
  Row ground_force(int foot, const Row& rate, const Row& volts, const Row& time) const {
    Row out;
    for (int j = 0; j < N; j++) out.set(j, force(foot, 0.0, rate[j], volts[j], time[j]));
    return out;
  }
  template <class F>
  TARSUS_INLINE static double on_ground(double value, double gap, F&& there) {
    return gap < 0.0 && !std::isfinite(value) ? there() : value;
  }
  template <class F>
  TARSUS_INLINE static Row on_ground(const Row& value, const Row& gap, F&& there) {
    if (__builtin_expect(!any_less(gap, Row(0.0)) || finite(value), 1)) return value;
    const Row ground = Row(there());
    Row out;
    for (int j = 0; j < N; j++) out.set(j, gap[j] < 0.0 && !std::isfinite(value[j]) ? ground[j] : value[j]);
    return out;
  }
};

}  // namespace tarsus
