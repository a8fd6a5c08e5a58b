// From piecewise polynomials to drive channels: the properties of every piece that a player looks up.
#pragma once
#include <cmath>

#include "drives/signals.hpp"

namespace tarsus {

constexpr double FOREVER = 1e30;  // [s] end of the piece that holds a last value
constexpr double SLIVER = 1e-5;   // a piece this much shorter than the longest may be shorter than any step
constexpr double LOST = 1e-12;    // share of the span below which a sliver's term is dropped: a drive's tolerance is 1e-9
constexpr double FAR = 1e4;       // spans that a sliver may be continued to: what it rounds then is below a drive's tolerance

// A channel of ``count`` pieces: start (count + 1) [s], coef (count, 12), kink (count): value or a derivative may jump where
// a piece starts; loop: piece that follows the last one, or -1: the last value is held.
struct Pieces {
  int64_t count, loop;
  const double *start, *coef;
  const bool* kink;
};

// How far [s] a piece may be continued beyond its end: a quarter of its length, a sliver much further.
inline double continued(double length, double longest, const double* coef, double span) {
  double over = 0.25 * length;
  if (!(length < SLIVER * longest)) return over;
  for (double lengths = 1.0; lengths < std::ldexp(1.0, 50); lengths *= 2.0) {
    double sum = 0.0, power = 1.0;
    for (int k = 1; k < DEGREE; k++) sum += std::fabs(coef[k]) * (power *= 1.0 + 2.0 * lengths);
    if (sum <= FAR * span) over = lengths * length;
  }
  return over;
}

// Append a channel to the signals.
inline void add_channel(Signals& out, const Pieces& from) {
  if (out.first.empty()) out.first.push_back(0);
  const size_t begin = out.start.size();
  out.start.insert(out.start.end(), from.start, from.start + from.count);
  out.end.insert(out.end.end(), from.start + 1, from.start + from.count + 1);
  out.coef.insert(out.coef.end(), from.coef, from.coef + DEGREE * from.count);
  for (int64_t p = 1; p < from.count; p++) out.sharp.push_back(from.kink[p]);
  out.sharp.push_back(from.loop >= 0 ? from.kink[from.loop] : 1);
  if (from.loop < 0) {
    double last = 0.0;
    for (int k = 0; k < DEGREE; k++) last += from.coef[DEGREE * (from.count - 1) + k];
    out.start.push_back(out.end.back());
    out.end.push_back(FOREVER);
    out.coef.push_back(last);
    out.coef.insert(out.coef.end(), DEGREE - 1, 0.0);
    out.sharp.push_back(0);
  }
  const size_t count = out.start.size() - begin;
  double top = -INF, bottom = INF, longest = 0.0;
  for (size_t p = begin; p < begin + count; p++) {
    double swing = 0.0;  // every piece is bounded by the sum of its coefficients' sizes
    for (int k = 1; k < DEGREE; k++) swing += std::fabs(out.coef[DEGREE * p + k]);
    out.flat.push_back(swing == 0.0);
    top = std::max(top, out.coef[DEGREE * p] + swing);
    bottom = std::min(bottom, out.coef[DEGREE * p] - swing);
    if (out.end[p] - out.start[p] < FOREVER / 2.0) longest = std::max(longest, out.end[p] - out.start[p]);
  }
  const double span = top - bottom;
  // rounded instants leave small terms of high degree in a sliver, and these would dominate where it is continued
  for (size_t p = begin; p < begin + count; p++) {
    if (!(out.end[p] - out.start[p] < SLIVER * longest)) continue;
    for (double* term = &out.coef[DEGREE * p + 1]; term < &out.coef[DEGREE * p] + DEGREE; term++) {
      if (std::fabs(*term) < LOST * span) *term = 0.0;
    }
  }
  out.until.resize(begin + count, INF);
  out.over.resize(begin + count, INF);
  for (int round = 0; round < 2; round++) {  // a second time round the loop, for pieces before its end
    double next = from.loop >= 0 ? out.until[begin + from.loop] : INF, over = from.loop >= 0 ? out.over[begin + from.loop] : INF;
    for (size_t p = begin + count; p-- > begin;) {
      const double length = out.end[p] - out.start[p];
      if (out.sharp[p]) {
        next = 0.0;
        over = continued(length, longest, &out.coef[DEGREE * p], span);
      }
      next += length;
      out.until[p] = next;
      out.over[p] = over;
    }
  }
  out.first.push_back(int64_t(out.start.size()));
  out.loop.push_back(from.loop);
  out.period.push_back(from.loop >= 0 ? from.start[from.count] - from.start[from.loop] : 0.0);
  out.span.push_back(span);
}

}  // namespace tarsus
