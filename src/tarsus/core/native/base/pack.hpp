// A pack: the values of some modes of a structure as one machine vector (a row holds the values at the nodes
// of a step instead).
#pragma once
#include "base/simd.hpp"

namespace tarsus {

constexpr int WIDEST = WIDTH;  // as in a row

template <int WIDTH>
struct PackOf {
  typedef double Type __attribute__((vector_size(8 * WIDTH)));
  typedef double Loose __attribute__((vector_size(8 * WIDTH), aligned(8)));
};

// How the modes of a structure lie in packs: ``COUNT`` packs of ``WIDTH``, or as many as there are where COUNT is 0.
template <int WIDTH_, int COUNT_>
struct Shape {
  static constexpr int WIDTH = WIDTH_, COUNT = COUNT_;
  typedef typename PackOf<WIDTH>::Type Pack;
  typedef typename PackOf<WIDTH>::Loose Loose;

  static TARSUS_INLINE int packs(int stride) { return COUNT > 0 ? COUNT : stride / WIDTH; }
  static TARSUS_INLINE int stride(int given) { return COUNT > 0 ? COUNT * WIDTH : given; }
  static TARSUS_INLINE Pack get(const double* at) { return *reinterpret_cast<const Loose*>(at); }
  static TARSUS_INLINE void put(double* at, const Pack& pack) { *reinterpret_cast<Loose*>(at) = pack; }
  static TARSUS_INLINE double sum(const Pack& a) {
    double out = a[0];
    for (int j = 1; j < WIDTH; j++) out += a[j];
    return out;
  }
  // Lengths sqrt(x^2 + y^2).
  static TARSUS_INLINE Pack length(const Pack& x, const Pack& y) {
    const Pack square = x * x + y * y;
    Pack out;
#ifdef __AVX512F__
    if constexpr (WIDTH == 8) return (Pack)_mm512_sqrt_pd((__m512d)square);
    if constexpr (WIDTH == 4) return (Pack)_mm256_sqrt_pd((__m256d)square);
    if constexpr (WIDTH == 2) return (Pack)_mm_sqrt_pd((__m128d)square);
#endif
    for (int j = 0; j < WIDTH; j++) out[j] = std::sqrt(square[j]);
    return out;
  }
};

// run(Shape) for structures whose states have room for so many blocks: one choice for all that runs them, so that all sum alike.
template <class Run>
auto by_shape(int stride, Run&& run) {
  switch (stride) {
    case 4: return run(Shape<std::min(WIDEST, 4), 4 / std::min(WIDEST, 4)>());
    case 8: return run(Shape<WIDEST, 8 / WIDEST>());
    default: return run(Shape<WIDEST, 0>());
  }
}

}  // namespace tarsus
