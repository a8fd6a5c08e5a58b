// Drive channels: piecewise polynomials of time with marked kinks, looping for ever.
#pragma once
#include <vector>

#include "base/nodes.hpp"

namespace tarsus {

constexpr double PIECE_ROUNDING = 1e-12;  // part of a piece by which instants computed from its length may err
constexpr double TIME_ROUNDING = 1e-15;   // and part of a time, some units in the last place

constexpr int DEGREE = 12;  // coefficients of a piece, in xi = 2 (t - start) / (end - start) - 1

// Pieces of channel c are first[c] .. first[c + 1] - 1. flat: a constant piece; sharp: its end is a kink; until [s]: from
// its start to the next kink (infinite: none); over [s]: how far the piece before that kink may be continued beyond it.
// loop: piece to go on with after the last one, or -1; period [s] of the loop; span: range of a channel's values.
// A run is driven by some of the channels.
struct Signals {
  std::vector<int64_t> first, loop;
  std::vector<double> start, end, coef, until, over, period, span;
  std::vector<uint8_t> flat, sharp;
  int channels() const { return int(loop.size()); }
};

// A channel of a run, and the piece that the run is in: shift [s], the time of the run at which the pieces' own time is 0 in this turn
// of the loop.
struct Cursor {
  int64_t piece, turns, first, behind, loop;
  double shift, period, span;
};

// The piece of every channel that a run is in. Times only grow.
struct Player {
  const Signals& signals;
  const Nodes& nodes;
  std::vector<Cursor> cursor;
  int64_t moves = 0;         // of any channel to another piece
  double flat_until = -INF;  // [s] until then all channels keep their values

  Player(const Signals& s, const Nodes& n, size_t channels) : signals(s), nodes(n), cursor(channels) {}

  int channels() const { return int(cursor.size()); }

  // Start a run with channels of its own.
  void restart(const int64_t* chosen) {
    same_until = flat_until = -INF;
    moves++;
    for (int c = 0; c < channels(); c++) {
      const int64_t of = chosen[c], first = signals.first[of];
      cursor[c] = {first, 0, first, signals.first[of + 1], signals.loop[of], 0.0, signals.period[of], signals.span[of]};
    }
  }

  // Move a channel to the piece that holds time t.
  void seek(int c, double t) {
    const Signals& s = signals;
    for (Cursor& at = cursor[c];;) {
      const int64_t p = at.piece;
      // a time within rounding of a piece's end counts as past it: no step could reach that end
      if (t < at.shift + s.end[p] - PIECE_ROUNDING * (s.end[p] - s.start[p]) - TIME_ROUNDING * t) return;
      if (!next_piece(at)) return;
    }
  }

  // Go on to the piece that follows; false where there is none.
  static bool next_piece(Cursor& at) {
    if (at.piece + 1 < at.behind) {
      at.piece++;
    } else if (at.loop >= 0) {
      at.piece = at.first + at.loop;
      at.turns++;
      at.shift = at.turns * at.period;
    } else {
      return false;
    }
    return true;
  }

  struct Kink {
    double left, reach;  // [s] to the next kink, and the longest step that may reach beyond it
  };

  // Move all channels to t. What is ahead stays the same until one of them changes its piece.
  TARSUS_INLINE Kink next_kink(double t) {
    if (!(t < same_until - TIME_ROUNDING * t)) move(t);
    return {kink - t, reach - t};
  }

  template <class Real>
  TARSUS_INLINE Real polynomial(int64_t p, const Real& xi) const {
    const double* k = signals.coef.data() + DEGREE * p;
    Real value = Real(k[DEGREE - 1]);
    for (int c = DEGREE - 2; c >= 0; c--) value = value * xi + k[c];
    return value;
  }

  // Value at time t, up to the next kink and from the left there. A step may have gone beyond the cursor's piece where that ends
  // smoothly.
  double value(int c, double t) const {
    Cursor at = cursor[c];
    const auto begun = [&] { return t - at.shift - signals.start[at.piece]; };
    while (begun() > signals.end[at.piece] - signals.start[at.piece] && !signals.sharp[at.piece] && next_piece(at)) {
    }
    const int64_t p = at.piece;
    if (signals.flat[p]) return level(at);
    return polynomial(p, 2.0 * begun() / (signals.end[p] - signals.start[p]) - 1.0);
  }

  // Values at the nodes of the step [t, t + h]; true where they are constant. A step may reach beyond a kink: the
  // stretch before the kink is continued, and the step is cut at the kink.
  bool fill(int c, double t, double h, double* out) const {
    const Signals& s = signals;
    const Cursor& now = cursor[c];
    const int64_t p = now.piece;
    if (s.flat[p] && (s.sharp[p] || t + h <= now.shift + s.end[p])) {
      store(out, Row(level(now)));
      return true;
    }
    // times from the start of the piece: those from t = 0 would round each node differently, which a short piece shows
    const double begun = t - now.shift - s.start[p], length = s.end[p] - s.start[p];
    if (s.sharp[p] || begun + h <= length) {
      store(out, polynomial(p, (begun + nodes.times() * h) * (2.0 / length) - 1.0));
      return false;
    }
    Cursor at = now;
    double from = begun;
    for (int j = 0; j < N; j++) {
      while (from + nodes.tau[j] * h > s.end[at.piece] - s.start[at.piece] && !s.sharp[at.piece]) {
        if (!next_piece(at)) break;
        from = t - at.shift - s.start[at.piece];
      }
      out[j] = polynomial(at.piece, 2.0 * (from + nodes.tau[j] * h) / (s.end[at.piece] - s.start[at.piece]) - 1.0);
    }
    return false;
  }

 private:
  double same_until = -INF;        // end of the first piece to end
  double kink = INF, reach = INF;  // times of the next kink, and up to which a step may reach beyond it

  double level(const Cursor& at) const { return signals.coef[DEGREE * at.piece]; }

  TARSUS_APART void move(double t) {
    const Signals& s = signals;
    moves++;
    same_until = kink = reach = flat_until = INF;
    for (int c = 0; c < channels(); c++) {
      seek(c, t);
      const Cursor& at = cursor[c];
      const int64_t p = at.piece;
      const double next = at.shift + s.start[p] + s.until[p];
      const bool last = p + 1 == at.behind && at.loop < 0;
      if (!last) same_until = std::min(same_until, at.shift + s.end[p] - PIECE_ROUNDING * (s.end[p] - s.start[p]));
      kink = std::min(kink, next);
      if (!s.sharp[p]) flat_until = std::min(flat_until, at.shift + s.end[p]);
      if (!s.flat[p]) flat_until = -INF;
      if (!(s.flat[p] && s.sharp[p])) reach = std::min(reach, next + s.over[p]);
    }
  }
};

}  // namespace tarsus
