// A law as a small vector program, made of its plain Python by tarsus.laws.program.
#pragma once
#include "simd.hpp"

namespace tarsus {

struct Program {
  const int32_t* code = nullptr;      // (count, 4): operation, three registers
  const double* constants = nullptr;
  int count = 0, arguments = 0, parameters = 0, registers = 0, result = 0;
};

template <class Real>
Real run(const Program&, const Real*, const double*, Real*) {
  return Real(0.0);
}

}  // namespace tarsus
