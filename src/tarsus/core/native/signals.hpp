// Drive channels: piecewise polynomials of time with marked kinks, looping for ever.
#pragma once
#include <vector>

#include "nodes.hpp"

namespace tarsus {

constexpr int DEGREE = 12;  // coefficients of a piece, in xi = 2 (t - start) / (end - start) - 1

// Pieces of channel c are first[c] .. first[c + 1] - 1. flat: a constant piece; sharp: its end is a kink; until [s]: from
// its start to the next kink (infinite: none); over [s]: how far the piece before that kink may be continued beyond it.
// loop: piece to go on with after the last one, or -1; period [s] of the loop; span: range of a channel's values.
struct Signals {
  std::vector<int64_t> first, loop;
  std::vector<double> start, end, coef, until, over, period, span;
  std::vector<uint8_t> flat, sharp;
  int channels() const { return int(loop.size()); }
};

struct Cursor {
  int64_t piece = 0, turns = 0;
};

// Where a run is in the channels it is driven by. Times only grow.
struct Player {
  const Signals& signals;
  const Nodes& nodes;
  std::vector<Cursor> cursor;
  int64_t moves = 0;         // of any channel to another piece
  double flat_until = -INF;  // [s] until then all channels keep their values

  Player(const Signals& s, const Nodes& n) : signals(s), nodes(n), cursor(s.channels()) {}

  void restart() {
    same_until = -INF;
    for (int c = 0; c < signals.channels(); c++) cursor[c] = {signals.first[c], 0};
  }

  // Move a channel to the piece that holds time t.
  void seek(int c, double t) {
    const Signals& s = signals;
    for (Cursor& at = cursor[c];;) {
      const int64_t p = at.piece;
      const double shift = at.turns * s.period[c];
      // within the rounding of the time itself the piece has ended: no step could reach its end
      if (t < shift + s.end[p] - 1e-12 * (s.end[p] - s.start[p]) - 1e-15 * t) return;
      if (p + 1 < s.first[c + 1]) {
        at.piece = p + 1;
      } else if (s.loop[c] >= 0) {
        at.piece = s.first[c] + s.loop[c];
        at.turns++;
      } else {
        return;
      }
    }
  }

  struct Kink {
    double left, reach;  // [s] to the next kink, and the longest step that may reach beyond it
  };

  // Move all channels to t. What is ahead stays the same until one of them changes its piece.
  TARSUS_INLINE Kink next_kink(double t) {
    if (!(t < same_until - 1e-15 * t)) move(t);
    return {kink - t, reach - t};
  }

  template <class Real>
  TARSUS_INLINE Real polynomial(int64_t p, const Real& xi) const {
    const double* k = signals.coef.data() + DEGREE * p;
    Real value = Real(k[DEGREE - 1]);
    for (int c = DEGREE - 2; c >= 0; c--) value = value * xi + k[c];
    return value;
  }

  // Value at time t within the cursor's piece (from the left at a kink).
  double value(int c, double t) const {
    const Cursor& at = cursor[c];
    const int64_t p = at.piece;
    if (signals.flat[p]) return signals.coef[DEGREE * p];
    const double begun = t - at.turns * signals.period[c] - signals.start[p];
    return polynomial(p, 2.0 * begun / (signals.end[p] - signals.start[p]) - 1.0);
  }

  // Values at the nodes of the step [t, t + h]; true where they are constant. A step may reach beyond a kink: the
  // stretch before the kink is continued, and the step is cut at the kink.
  bool fill(int c, double t, double h, double* out) const {
    const Signals& s = signals;
    int64_t p = cursor[c].piece, turns = cursor[c].turns;
    double shift = turns * s.period[c];
    if (s.flat[p] && (s.sharp[p] || t + h <= shift + s.end[p])) {
      store(out, Row(s.coef[DEGREE * p]));
      return true;
    }
    // times from the start of the piece: those from t = 0 would round each node differently, which a short piece shows
    double begun = t - shift - s.start[p], length = s.end[p] - s.start[p];
    if (s.sharp[p] || begun + h <= length) {
      store(out, polynomial(p, (begun + nodes.times() * h) * (2.0 / length) - 1.0));
      return false;
    }
    for (int j = 0; j < N; j++) {
      while (begun + nodes.tau[j] * h > s.end[p] - s.start[p] && !s.sharp[p]) {
        if (p + 1 < s.first[c + 1]) {
          p++;
        } else if (s.loop[c] >= 0) {
          p = s.first[c] + s.loop[c];
          turns++;
          shift = turns * s.period[c];
        } else {
          break;
        }
        begun = t - shift - s.start[p];
      }
      out[j] = polynomial(p, 2.0 * (begun + nodes.tau[j] * h) / (s.end[p] - s.start[p]) - 1.0);
    }
    return false;
  }

 private:
  double same_until = -INF;            // end of the first piece to end
  double kink = INF, reach = INF;      // times of the next kink, and up to which a step may reach beyond it

  TARSUS_APART void move(double t) {
    moves++;
    same_until = kink = reach = flat_until = INF;
    for (int c = 0; c < signals.channels(); c++) {
      seek(c, t);
      const int64_t p = cursor[c].piece;
      const double shift = cursor[c].turns * signals.period[c], next = shift + signals.start[p] + signals.until[p];
      const bool last = p + 1 == signals.first[c + 1] && signals.loop[c] < 0;
      if (!last) same_until = std::min(same_until, shift + signals.end[p] - 1e-12 * (signals.end[p] - signals.start[p]));
      kink = std::min(kink, next);
      if (!signals.sharp[p]) flat_until = std::min(flat_until, shift + signals.end[p]);
      if (!signals.flat[p]) flat_until = -INF;
      if (!(signals.flat[p] && signals.sharp[p])) reach = std::min(reach, next + signals.over[p]);
    }
  }
};

}  // namespace tarsus
