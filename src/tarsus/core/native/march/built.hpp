// How this module was built: by what, for what machine, and how wide the machine's vectors are.
#pragma once
#include <nanobind/nanobind.h>

// What CMake passes on; a file of this folder compiled by hand says that it does not know.
#ifndef TARSUS_TARGET
#define TARSUS_TARGET "unknown"
#endif
#ifndef TARSUS_SANITIZE
#define TARSUS_SANITIZE ""
#endif

#define TARSUS_TEXT_OF(value) #value
#define TARSUS_TEXT(value) TARSUS_TEXT_OF(value)
#if defined(__clang__)
#define TARSUS_COMPILER \
  "clang " TARSUS_TEXT(__clang_major__) "." TARSUS_TEXT(__clang_minor__) "." TARSUS_TEXT(__clang_patchlevel__)
#elif defined(__GNUC__)
#define TARSUS_COMPILER "gcc " TARSUS_TEXT(__GNUC__) "." TARSUS_TEXT(__GNUC_MINOR__) "." TARSUS_TEXT(__GNUC_PATCHLEVEL__)
#else
#define TARSUS_COMPILER "unknown"
#endif

#if defined(__AVX512F__)
#define TARSUS_ROWS "AVX-512"
#elif defined(__AVX2__)
#define TARSUS_ROWS "AVX2"
#elif defined(__AVX__)
#define TARSUS_ROWS "AVX"
#elif defined(__SSE2__) || defined(_M_X64)
#define TARSUS_ROWS "SSE"
#elif defined(__ARM_NEON)
#define TARSUS_ROWS "NEON"
#elif defined(__wasm_simd128__)
#define TARSUS_ROWS "SIMD128"
#else
#define TARSUS_ROWS "scalar"
#endif

namespace tarsus {

// compiler: name and version; target: TARSUS_TARGET of CMakeLists.txt; rows: the instructions a row of eight is worked on
// with; checks: what the compiler checks at run time, empty in all but the sanitizer lane.
inline nanobind::dict built() {
  nanobind::dict out;
  out["compiler"] = TARSUS_COMPILER;
  out["target"] = TARSUS_TARGET;
  out["rows"] = TARSUS_ROWS;
  out["checks"] = TARSUS_SANITIZE;
  return out;
}

}  // namespace tarsus
