// The level of x86-64 (2, 3 or 4 of its ABI) that the processor and the operating system have; 1 for any x86-64, 0 for other machines.
#pragma once
#if defined(__x86_64__) || defined(_M_X64)
#include <cpuid.h>
#endif

namespace tarsus {

#if defined(__x86_64__) || defined(_M_X64)

struct Registers {
  unsigned a = 0, b = 0, c = 0, d = 0;

  explicit Registers(unsigned leaf) { __get_cpuid_count(leaf, 0, &a, &b, &c, &d); }
};

// Which registers the operating system saves when it changes from one program to another (XCR0).
inline unsigned saved_registers() {
  unsigned low, high;
  __asm__ volatile("xgetbv" : "=a"(low), "=d"(high) : "c"(0));
  return low;
}

inline bool has(unsigned found, unsigned bits) { return (found & bits) == bits; }

inline int x86_64_level() {
  constexpr unsigned LAHF = 1u << 0, LZCNT = 1u << 5;
  constexpr unsigned SSE3 = 1u << 0, SSSE3 = 1u << 9, FMA = 1u << 12, CX16 = 1u << 13, SSE41 = 1u << 19, SSE42 = 1u << 20, MOVBE = 1u << 22,
                     POPCNT = 1u << 23, OSXSAVE = 1u << 27, AVX = 1u << 28, F16C = 1u << 29;
  constexpr unsigned BMI1 = 1u << 3, AVX2 = 1u << 5, BMI2 = 1u << 8;
  constexpr unsigned AVX512 = 1u << 16 | 1u << 17 | 1u << 28 | 1u << 30 | 1u << 31;  // F, DQ, CD, BW, VL
  constexpr unsigned HALVES = 0x6, WHOLE = 0xe6;                                     // of XCR0: 256 bits, 512 bits and masks
  const unsigned first = Registers(1).c, seventh = Registers(7).b, extended = Registers(0x80000001).c;
  if (!has(first, SSE3 | SSSE3 | CX16 | SSE41 | SSE42 | POPCNT) || !has(extended, LAHF)) return 1;
  if (!has(first, FMA | MOVBE | OSXSAVE | AVX | F16C) || !has(seventh, BMI1 | AVX2 | BMI2) || !has(extended, LZCNT)) return 2;
  const unsigned saved = saved_registers();
  if (!has(saved, HALVES)) return 2;
  return has(seventh, AVX512) && has(saved, WHOLE) ? 4 : 3;
}

#else

inline int x86_64_level() { return 0; }

#endif

}  // namespace tarsus
