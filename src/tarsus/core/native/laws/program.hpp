// A law as a program (tarsus.model.laws.program): operations on numbers, carried out for eight nodes at once.
//
// ``link`` reads the plain list once. What depends on parameters and constants alone is set apart:
// ``prepare`` computes it whenever the parameters change (the *fixed* values), ``evaluate`` does the rest for
// given arguments. Real is double, Row or a Dual.
//
// Results equal those of plain Python to the last bit where the operation is exactly rounded (+ - * / sqrt,
// comparisons): a product and a sum are never contracted into one operation.
#pragma once
#include <stdexcept>
#include <vector>

#include "base/dual.hpp"

namespace tarsus {

// name, function: the operations of one and of two operands that the machine has no form of its own for.
#define TARSUS_FUNCTIONS_OF_ONE(X)                                                                     \
  X(ABSOLUTE, magnitude) X(SQRT, square_root) X(FLOOR, floored) X(CEIL, ceiled) X(TRUNC, truncated)    \
  X(ROUND, rounded) X(EXP, exponential) X(EXPM1, exponential_less_one) X(LOG, logarithm)               \
  X(LOG1P, logarithm_of_one_plus) X(LOG2, binary_logarithm) X(LOG10, decimal_logarithm) X(SIN, sine)   \
  X(COS, cosine) X(TAN, tangent) X(ASIN, arc_sine) X(ACOS, arc_cosine) X(ATAN, arc_tangent)            \
  X(SINH, hyperbolic_sine) X(COSH, hyperbolic_cosine) X(TANH, hyperbolic_tangent) X(ASINH, area_sine)  \
  X(ACOSH, area_cosine) X(ATANH, area_tangent) X(ERF, error_function)                                  \
  X(ERFC, complementary_error_function) X(ISFINITE, is_finite) X(ISNAN, is_nan) X(ISINF, is_infinite)
#define TARSUS_FUNCTIONS_OF_TWO(X)                                                                     \
  X(LESS, less) X(LESS_EQUAL, less_equal) X(EQUAL, equal) X(NOT_EQUAL, not_equal)                      \
  X(MINIMUM, minimum) X(MAXIMUM, maximum) X(POWER, power) X(FLOOR_DIVIDE, floor_divide)                \
  X(MODULO, modulo) X(FMOD, remainder_towards_zero) X(HYPOT, hypotenuse) X(ATAN2, arc_tangent_of)      \
  X(COPYSIGN, with_sign)

// As tarsus.model.laws.program.Op numbers them.
#define TARSUS_OPERATIONS(X)                                                                           \
  X(COPY) X(ADD) X(SUBTRACT) X(MULTIPLY) X(DIVIDE) X(NEGATE) X(LESS) X(LESS_EQUAL) X(EQUAL)            \
  X(NOT_EQUAL) X(SELECT) X(MINIMUM) X(MAXIMUM) X(ABSOLUTE) X(SQRT) X(FLOOR) X(CEIL) X(TRUNC) X(ROUND)  \
  X(POWER) X(FLOOR_DIVIDE) X(MODULO) X(FMOD) X(HYPOT) X(ATAN2) X(COPYSIGN) X(EXP) X(EXPM1) X(LOG)      \
  X(LOG1P) X(LOG2) X(LOG10) X(SIN) X(COS) X(TAN) X(ASIN) X(ACOS) X(ATAN) X(SINH) X(COSH) X(TANH)       \
  X(ASINH) X(ACOSH) X(ATANH) X(ERF) X(ERFC) X(ISFINITE) X(ISNAN) X(ISINF)
// Forms with a fixed operand (F) and a value (V), which then need not be spread over a row; and with the
// result of the instruction before (L), which is still in a register: memory would add its delay to every
// link of a chain.
#define TARSUS_FORMS(X)                                                                                \
  X(SPREAD) X(SQUARE) X(ADD_VF) X(SUBTRACT_VF) X(SUBTRACT_FV) X(MULTIPLY_VF) X(DIVIDE_VF) X(DIVIDE_FV) \
  X(SELECT_VVF) X(SELECT_VFV) X(SELECT_VFF)                                                            \
  X(SQUARE_L) X(ADD_LV) X(ADD_LF) X(SUBTRACT_LV) X(SUBTRACT_VL) X(SUBTRACT_LF) X(SUBTRACT_FL)          \
  X(MULTIPLY_LV) X(MULTIPLY_LF) X(DIVIDE_LV) X(DIVIDE_VL) X(DIVIDE_LF) X(DIVIDE_FL)

namespace op {
enum Op : uint16_t {
#define X(name) name,
  TARSUS_OPERATIONS(X) COUNT, FORMS = COUNT - 1, TARSUS_FORMS(X)
#undef X
};
}  // namespace op

struct Instruction {
  uint16_t op, a, b, c;
};

struct Program {
  std::vector<Instruction> first;  // on fixed values: parameters, constants, then its own results
  std::vector<Instruction> body;   // on values: arguments, then its own results; the last is the law's
  std::vector<double> constants;
  int arguments = 0, parameters = 0;

  int fixed() const { return parameters + int(constants.size() + first.size()); }
  int registers() const { return arguments + int(body.size()); }
};

// next[i] = result of instruction i, from values at ``own`` and fixed ones at ``fixed``.
template <class Real>
TARSUS_INLINE void execute(const Instruction* code, int count, const Real* own, const double* fixed,
                           Real* next) {
  Real last = Real(0.0);
  for (int i = 0; i < count; i++) {
    const Instruction it = code[i];
    const Real& a = own[it.a];
    switch (it.op) {
      case op::COPY: last = a; break;
      case op::ADD: last = a + own[it.b]; break;
      case op::ADD_VF: last = a + fixed[it.b]; break;
      case op::ADD_LV: last = last + own[it.b]; break;
      case op::ADD_LF: last = last + fixed[it.b]; break;
      case op::SUBTRACT: last = a - own[it.b]; break;
      case op::SUBTRACT_VF: last = a - fixed[it.b]; break;
      case op::SUBTRACT_FV: last = fixed[it.b] - a; break;
      case op::SUBTRACT_LV: last = last - own[it.b]; break;
      case op::SUBTRACT_VL: last = own[it.b] - last; break;
      case op::SUBTRACT_LF: last = last - fixed[it.b]; break;
      case op::SUBTRACT_FL: last = fixed[it.b] - last; break;
      case op::MULTIPLY: last = a * own[it.b]; break;
      case op::MULTIPLY_VF: last = a * fixed[it.b]; break;
      case op::MULTIPLY_LV: last = last * own[it.b]; break;
      case op::MULTIPLY_LF: last = last * fixed[it.b]; break;
      case op::SQUARE: last = squared(a); break;
      case op::SQUARE_L: last = squared(last); break;
      case op::DIVIDE: last = a / own[it.b]; break;
      case op::DIVIDE_VF: last = a / fixed[it.b]; break;
      case op::DIVIDE_FV: last = fixed[it.b] / a; break;
      case op::DIVIDE_LV: last = last / own[it.b]; break;
      case op::DIVIDE_VL: last = own[it.b] / last; break;
      case op::DIVIDE_LF: last = last / fixed[it.b]; break;
      case op::DIVIDE_FL: last = fixed[it.b] / last; break;
      case op::NEGATE: last = -a; break;
      case op::SELECT: last = select(a, own[it.b], own[it.c]); break;
      case op::SELECT_VVF: last = select(a, own[it.b], Real(fixed[it.c])); break;
      case op::SELECT_VFV: last = select(a, Real(fixed[it.b]), own[it.c]); break;
      case op::SELECT_VFF: last = select(a, Real(fixed[it.b]), Real(fixed[it.c])); break;
      case op::SPREAD: last = Real(fixed[it.a]); break;
#define X(name, function) case op::name: last = function(a); break;
      TARSUS_FUNCTIONS_OF_ONE(X)
#undef X
#define X(name, function) case op::name: last = function(a, own[it.b]); break;
      TARSUS_FUNCTIONS_OF_TWO(X)
#undef X
    }
    next[i] = last;
  }
}

// The fixed values of given parameters; ``fixed`` has room for program.fixed().
inline void prepare(const Program& program, const double* parameters, double* fixed) {
  for (int i = 0; i < program.parameters; i++) fixed[i] = parameters[i];
  double* rest = fixed + program.parameters;
  for (const double constant : program.constants) *rest++ = constant;
  execute(program.first.data(), int(program.first.size()), fixed, fixed, rest);
}

// The law's value; the arguments are the first of ``registers``, which has room for program.registers().
template <class Real>
inline const Real& evaluate(const Program& program, const double* fixed, Real* registers) {
  const int count = int(program.body.size());
  execute(program.body.data(), count, registers, fixed, registers + program.arguments);
  return registers[program.arguments + count - 1];
}

// ---- from the plain list

// Translates values numbered arguments, parameters, constants, results into fixed ones and those of the body.
class Linker {
 public:
  Linker(const int32_t* code, int count, const double* constants, int number, int arguments, int parameters)
      : code_(code), count_(count) {
    program_.arguments = arguments;
    program_.parameters = parameters;
    program_.constants.assign(constants, constants + number);
    const int inputs = arguments + parameters + number;
    if (arguments < 0 || parameters < 0 || count < 1 || inputs + int64_t(count) > 32767)
      throw std::invalid_argument("a program has at least one operation and at most 32767 values");
    for (int i = 0; i < inputs; i++) places_.push_back({i >= arguments, i >= arguments ? i - arguments : i});
  }

  Program link() {
    for (int i = 0; i < count_; i++) translate(code_ + 4 * i);
    if (places_.back().fixed) emit(op::SPREAD, places_.back().at);
    return program_;
  }

 private:
  struct Place {
    bool fixed;
    int at;
  };

  void translate(const int32_t* row) {
    if (row[0] < 0 || row[0] >= op::COUNT) throw std::invalid_argument("unknown operation of a program");
    const int taken = operands(row[0]);
    Place of[3] = {};
    bool fixed = true;
    for (int k = 0; k < taken; k++) {
      if (row[1 + k] < 0 || row[1 + k] >= int(places_.size()))
        throw std::invalid_argument("an operation of a program uses a value that comes later");
      of[k] = places_[row[1 + k]];
      fixed = fixed && of[k].fixed;
    }
    if (fixed) {
      program_.first.push_back(instruction(row[0], of[0].at, of[1].at, of[2].at));
      places_.push_back({true, program_.fixed() - 1});
    } else {
      places_.push_back({false, mixed(row[0], of, taken)});
    }
  }

  int mixed(int operation, Place* of, int taken) {
    const bool f0 = of[0].fixed, f1 = of[1].fixed, f2 = of[2].fixed;
    const int a = of[0].at, b = of[1].at, c = of[2].at;
    const int last = program_.body.empty() ? -1 : program_.registers() - 1;
    const bool l0 = !f0 && a == last, l1 = !f1 && b == last;
    switch (operation) {
      case op::ADD:
        if (f0) return l1 ? emit(op::ADD_LF, 0, a) : emit(op::ADD_VF, b, a);
        if (f1) return l0 ? emit(op::ADD_LF, 0, b) : emit(op::ADD_VF, a, b);
        if (l0 || l1) return emit(op::ADD_LV, 0, l0 ? b : a);
        break;
      case op::MULTIPLY:
        if (f0) return l1 ? emit(op::MULTIPLY_LF, 0, a) : emit(op::MULTIPLY_VF, b, a);
        if (f1) return l0 ? emit(op::MULTIPLY_LF, 0, b) : emit(op::MULTIPLY_VF, a, b);
        if (a == b) return emit(l0 ? op::SQUARE_L : op::SQUARE, a);
        if (l0 || l1) return emit(op::MULTIPLY_LV, 0, l0 ? b : a);
        break;
      case op::SUBTRACT:
        if (f0) return l1 ? emit(op::SUBTRACT_FL, 0, a) : emit(op::SUBTRACT_FV, b, a);
        if (f1) return l0 ? emit(op::SUBTRACT_LF, 0, b) : emit(op::SUBTRACT_VF, a, b);
        if (l0 || l1) return l0 ? emit(op::SUBTRACT_LV, 0, b) : emit(op::SUBTRACT_VL, 0, a);
        break;
      case op::DIVIDE:
        if (f0) return l1 ? emit(op::DIVIDE_FL, 0, a) : emit(op::DIVIDE_FV, b, a);
        if (f1) return l0 ? emit(op::DIVIDE_LF, 0, b) : emit(op::DIVIDE_VF, a, b);
        if (l0 || l1) return l0 ? emit(op::DIVIDE_LV, 0, b) : emit(op::DIVIDE_VL, 0, a);
        break;
      case op::SELECT:
        if (!f0 && f1) return emit(f2 ? op::SELECT_VFF : op::SELECT_VFV, a, b, c);
        if (!f0 && f2) return emit(op::SELECT_VVF, a, b, c);
        break;
    }
    int at[3] = {};
    for (int k = 0; k < taken; k++) at[k] = of[k].fixed ? spread(of[k].at) : of[k].at;
    return emit(operation, at[0], at[1], at[2]);
  }

  // The register that holds a fixed value spread over a row, filled once.
  int spread(int fixed) {
    const std::vector<Instruction>& body = program_.body;
    for (size_t i = 0; i < body.size(); i++)
      if (body[i].op == op::SPREAD && body[i].a == fixed) return program_.arguments + int(i);
    return emit(op::SPREAD, fixed);
  }

  int emit(int operation, int a, int b = 0, int c = 0) {
    program_.body.push_back(instruction(operation, a, b, c));
    return program_.registers() - 1;
  }

  static Instruction instruction(int operation, int a, int b, int c) {
    return {uint16_t(operation), uint16_t(a), uint16_t(b), uint16_t(c)};
  }

  static int operands(int operation) {
    switch (operation) {
      case op::SELECT: return 3;
      case op::ADD: case op::SUBTRACT: case op::MULTIPLY: case op::DIVIDE:
#define X(name, function) case op::name:
      TARSUS_FUNCTIONS_OF_TWO(X)
#undef X
        return 2;
    }
    return 1;
  }

  const int32_t* code_;
  int count_;
  Program program_;
  std::vector<Place> places_;
};

inline Program link(const int32_t* code, int count, const double* constants, int number, int arguments,
                    int parameters) {
  return Linker(code, count, constants, number, arguments, parameters).link();
}

}  // namespace tarsus
