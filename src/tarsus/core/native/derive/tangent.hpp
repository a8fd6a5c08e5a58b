// Eight tangents at once: first derivatives of what enters a run, and of its laws and drives.
//
// A *lane* is one parameter. A Jet is a number with its derivative in every lane; a Row holds the derivatives alone, where
// the maps applied to them are linear.
#pragma once
#include "march/batch.hpp"
#include "march/friction.hpp"
#include "drives/signals.hpp"
#include "march/batch.hpp"

namespace tarsus {

constexpr int LANES = N;
typedef Dual<double, LANES> Jet;

inline Jet jet(double value, const Row& slope) {
  Jet out;
  out.value = value;
  store(out.slope, slope);
  return out;
}
inline Row slope_of(const Jet& a) { return load(a.slope); }

// Why a derivative does not exist, or to one side only. The only list of these numbers: Python takes it from ``DOUBTS``. APART:
// events or kinks of one moment move apart, so that what is integrated over the steps between them has no derivative here; all
// else has.
enum Doubtful { GRAZING = 1, SIMULTANEOUS = 2, AT_THRESHOLD = 3, LOST = 4, EDGE_AT_START = 5, APART = 6, NEAR_MISS = 7, AT_CORNER = 8 };
constexpr const char* DOUBTS[] = {"GRAZING", "SIMULTANEOUS", "AT_THRESHOLD", "LOST", "EDGE_AT_START", "APART", "NEAR_MISS", "AT_CORNER"};

struct TangentFlag {
  double event, reason, lane;  // lane -1: all
};

// Derivatives of the data of one run. coef (pieces, 12), begin and end (pieces) [s]: of the pieces of all channels, at fixed
// numbers in them; loops (channels) [s]: of their periods; profile: of the shape of uneven ground; period [s]: of the marks; start [s]: of the moment at which a window
// begins, and contacts and flights that begin with it.
struct DataTangents {
  std::vector<Row> parameters, initial, sources, since, coef, begin, end, loops, profile;
  Row period, start = Row(0.0);

  // Of the same data, by numbers that nothing depends on.
  DataTangents nothing() const {
    DataTangents out = *this;
    for (auto* part : {&out.parameters, &out.initial, &out.sources, &out.since, &out.coef, &out.begin, &out.end, &out.loops, &out.profile}) {
      std::fill(part->begin(), part->end(), Row(0.0));
    }
    out.period = out.start = Row(0.0);
    return out;
  }

  // The same of a size; coordinates: of the structure.
  static DataTangents none(size_t coordinates, const Laws& laws, const Signals& signals) {
    const size_t feet = laws.feet, pieces = signals.start.size();
    const auto rows = [](size_t count) { return std::vector<Row>(count, Row(0.0)); };
    return {rows(feet * laws.columns), rows(2 * coordinates), rows(feet + GRAVITIES), rows(feet), rows(pieces * DEGREE), rows(pieces),
            rows(pieces), rows(signals.loop.size()), {}, Row(0.0), Row(0.0)};
  }
};

// Drives with their derivatives at fixed times. A piece from a to b has xi = 2 (t - a) / (b - a) - 1, so that with moving ends
//   du = sum dk xi^k + u'(xi) dxi,   dxi = -2 / (b - a) [da + (xi + 1) / 2 (db - da)].
struct DriveTangents {
  const Signals& signals;
  const DataTangents& data;
  Player player;

  DriveTangents(const Signals& s, const Nodes& n, const DataTangents& d, const RunData& run, size_t channels)
      : signals(s), data(d), player(s, n, channels), chosen_(run.channels, run.channels + channels) {
    player.restart(run.channels);
    for (size_t p = 0; p < s.start.size(); p++) {
      int most = DEGREE - 1;
      while (most > 0 && s.coef[DEGREE * p + most] == 0.0 && !any_less(Row(0.0), magnitude(d.coef[DEGREE * p + most]))) most--;
      degrees_.push_back(most);
    }
  }

  // Where a piece begins [s], in the run's time.
  Jet beginning(int c, const Cursor& at) const { return jet(at.shift + signals.start[at.piece], moved(c, at, data.begin[at.piece])); }

  // Whether a channel that goes from one place to another does so by a kink at a time, within the rounding of the player: what
  // lies further back is no kink, and nothing jumps there.
  bool passed(const Cursor& was, const Cursor& now, double time) const {
    if (was.piece == now.piece && was.turns == now.turns) return false;
    const double rounding = 2e-12 * (signals.end[was.piece] - signals.start[was.piece]) + 1e-14 * time;
    return std::fabs(now.shift + signals.start[now.piece] - time) <= rounding;
  }

  // Value in the piece of a cursor at a time, which may move.
  Jet value(int c, const Cursor& at, const Jet& time) const {
    const int64_t p = at.piece;
    const double a = signals.start[p], length = signals.end[p] - a;
    const Row da = moved(c, at, data.begin[p]), db = moved(c, at, data.end[p]);
    const double x = degrees_[p] == 0 ? 0.0 : 2.0 * (time.value - at.shift - a) / length - 1.0;
    const double* k = signals.coef.data() + DEGREE * p;
    double u = 0.0, slope = 0.0;
    Row du = Row(0.0);
    for (int n = degrees_[p]; n >= 0; n--) {
      slope = slope * x + u;
      u = u * x + k[n];
      du = du * x + data.coef[DEGREE * p + n];
    }
    if (slope != 0.0) du += (slope_of(time) - da - (db - da) * (0.5 * (x + 1.0))) * (2.0 / length * slope);
    return jet(u, du);
  }

  // Values at the nodes of the step [t, t + h], continued beyond kinks as the player does. Moves on to the piece at t.
  void fill(int c, double t, double h, double* value_to, Row* slope_to) {
    player.seek(c, t);
    Cursor at = player.cursor[c];
    double from = t - at.shift - signals.start[at.piece];
    for (int j = 0; j < N; j++) {
      while (from + player.nodes.tau[j] * h > signals.end[at.piece] - signals.start[at.piece] && !signals.sharp[at.piece]) {
        if (!Player::next_piece(at)) break;
        from = t - at.shift - signals.start[at.piece];
      }
      const Jet found = value(c, at, Jet(t + player.nodes.tau[j] * h));
      value_to[j] = found.value;
      slope_to[j] = slope_of(found);
    }
  }

  // Drives whose edge lies at the very start and moves against it: on one side they have an effect there.
  template <class Flag>
  void edges_at(double time, Flag&& flag) const {
    jumps_at(time, [&](int c, const Cursor& at) {
      const Jet edge = beginning(c, at);
      for (int lane = 0; lane < LANES; lane++) {
        if (edge.slope[lane] != data.start[lane]) flag(lane);
      }
    });
  }

  // Channels that jump at the very start: found(channel, cursor).
  template <class Found>
  void jumps_at(double time, Found&& found) const {
    const Signals& s = signals;
    for (size_t c = 0; c < chosen_.size(); c++) {
      const Cursor& at = player.cursor[c];
      if (std::fabs(at.shift + s.start[at.piece] - time) > 1e-12 * (s.end[at.piece] - s.start[at.piece]) + 1e-14 * time) continue;
      const bool first = at.piece == at.first || at.piece == at.first + at.loop;  // before either, the end of a period
      if (first && at.loop < 0) continue;
      double jump = 0.0;  // from the end of the piece before to the start of this one
      for (int k = 0; k < DEGREE; k++) {
        jump += s.coef[DEGREE * (first ? at.behind - 1 : at.piece - 1) + k] - (k % 2 ? -1.0 : 1.0) * s.coef[DEGREE * at.piece + k];
      }
      if (std::fabs(jump) > 1e-9 * s.span[chosen_[c]]) found(int(c), at);
    }
  }

 private:
  std::vector<int64_t> chosen_;
  std::vector<int> degrees_;  // of the pieces' values and their derivatives

  Row moved(int c, const Cursor& at, const Row& end) const {
    return end + data.loops[chosen_[c]] * double(at.turns);
  }
};

// The laws with their derivatives, all by their programs: ``laws`` has no twins.
struct LawTangents {
  const Laws& laws;
  std::vector<uint8_t> varied;        // whether a parameter of a foot has a derivative
  std::vector<PatchOf<Jet>> patches;  // of every foot, of uneven ground; none where all are 1

  // ``slopes``: derivatives of the parameters.
  LawTangents(const Laws& l, const double* parameters, const std::vector<Row>& slopes)
      : laws(l), varied(l.feet, 0), plain_(l), fixed_(size_t(l.feet) * l.fixed), registers_(l.registers), rows_(l.registers),
        spread_(fixed_.size()), wide_(l.registers) {
    plain_.take(parameters);
    for (const auto& terms : laws.terms) {
      for (const Term& term : terms) {
        const Program& program = laws.programs[term.program];
        for (int i = 0; i < laws.feet; i++) {
          std::vector<Jet> given;
          for (int k = 0; k < program.parameters; k++) {
            const size_t at = size_t(i) * laws.columns + term.first + k;
            given.push_back(jet(parameters[at], slopes[at]));
            if (any_less(Row(0.0), magnitude(slopes[at]))) varied[i] = 1;
          }
          prepare(program, given.data(), fixed_.data() + size_t(i) * laws.fixed + term.fixed);
        }
      }
    }
    for (size_t n = 0; n < fixed_.size(); n++) {
      spread_[n].value = Row(fixed_[n].value);
      for (int lane = 0; lane < LANES; lane++) spread_[n].slope[lane] = Row(fixed_[n].slope[lane]);
    }
  }

  bool has(int foot, int flag) const { return (laws.flags[foot] & flag) != 0; }
  const ActingLaws& plain() const { return plain_; }

  // The function of a hook at arguments that vary.
  Jet value(Hook hook, int foot, std::initializer_list<Jet> arguments) {
    Jet sum(0.0);
    for (const Term& term : laws.terms[hook]) {
      std::copy_n(arguments.begin(), laws.programs[term.program].arguments, registers_.begin());
      sum = sum + evaluate(laws.programs[term.program], fixed_.data() + size_t(foot) * laws.fixed + term.fixed, registers_.data());
    }
    return sum;
  }
  Jet momentum(int foot, const Jet& gap) { return value(MOMENTUM, foot, {gap}); }
  Jet force(int foot, const Jet& gap, const Jet& rate, const Jet& volts, const Jet& time) {
    return value(FORCE, foot, {gap, rate, volts, time});
  }
  // As those of ActingLaws.
  Jet rebound(int foot, const Jet& speed) { return patched(value(REBOUND, foot, {speed}), foot, &PatchOf<Jet>::rebound); }
  Jet strength(int foot, const Jet& age, const Jet& volts) {
    return patched(value(STRENGTH, foot, {age, volts}), foot, &PatchOf<Jet>::strength);
  }
  Jet remaining(int foot, const Jet& age, const Jet& away) { return value(REMAINING, foot, {age, away}); }
  Jet friction(int foot, const Jet& margin, const Jet& held, const Jet& speed) {
    return patched(value(FRICTION, foot, {margin, held, speed}), foot, &PatchOf<Jet>::friction);
  }
  Jet excess(int foot, const Jet& departing) { return value(EXCESS, foot, {departing}); }
  // Its slope by its first argument, by a central difference over a probe.
  Jet momentum_slope(int foot, const Jet& gap, double probe) {
    return (momentum(foot, gap + probe) - momentum(foot, gap - probe)) / (2.0 * probe);
  }

  // The bound of friction at eight nodes, with what it has by the parameters of its law.
  Dual<Row, LANES> friction(int foot, const Row& margin, const Row& held, const Row& speed) {
    Dual<Row, LANES> sum(Row(0.0));
    for (const Term& term : laws.terms[FRICTION]) {
      const Row arguments[FRICTION_ARGUMENTS] = {margin, held, speed};
      std::copy_n(arguments, laws.programs[term.program].arguments, wide_.begin());
      sum = sum + evaluate(laws.programs[term.program], spread_.data() + size_t(foot) * laws.fixed + term.fixed, wide_.data());
    }
    if (patches.empty()) return sum;
    const Jet& by = patches[foot].friction;
    for (int lane = 0; lane < LANES; lane++) sum.slope[lane] = sum.slope[lane] * by.value + sum.value * by.slope[lane];
    sum.value = sum.value * by.value;
    return sum;
  }

  // Slopes of a hook's function by its first two arguments at eight nodes; of ``count`` arguments. A value that is none, which
  // is only below the ground, is held there by the engine: it has no slope.
  void slopes(Hook hook, int foot, const Row* arguments, int count, Row& first, Row& second) {
    first = second = Row(0.0);
    for (const Term& term : laws.terms[hook]) {
      for (int a = 0; a < count; a++) {
        rows_[a] = Dual<Row, 2>(arguments[a]);
        if (a < 2) rows_[a].slope[a] = Row(1.0);
      }
      const auto& found = evaluate(laws.programs[term.program],
                                   plain_.fixed.data() + size_t(foot) * laws.fixed + term.fixed, rows_.data());
      first += found.slope[0];
      second += found.slope[1];
    }
    for (int j = 0; j < N; j++) {
      if (std::isfinite(first[j]) && std::isfinite(second[j])) continue;
      first.set(j, 0.0);
      second.set(j, 0.0);
    }
  }

  // Add to tangents at eight nodes what a hook's function has by its parameters, and by its third argument, volts, which has
  // the tangents ``by_volts`` there (none where null).
  void add_explicit(Hook hook, int foot, const Row* arguments, int count, const Row* by_volts, Row* to) {
    for (const Term& term : laws.terms[hook]) {
      for (int a = 0; a < count; a++) wide_[a] = Dual<Row, LANES>(arguments[a]);
      for (int lane = 0; by_volts != nullptr && lane < LANES; lane++) {
        for (int j = 0; j < N; j++) wide_[2].slope[lane].set(j, by_volts[j][lane]);
      }
      const auto& found = evaluate(laws.programs[term.program], spread_.data() + size_t(foot) * laws.fixed + term.fixed, wide_.data());
      for (int j = 0; j < N; j++) {
        if (!std::isfinite(found.value[j])) continue;
        for (int lane = 0; lane < LANES; lane++) to[j].set(lane, to[j][lane] + found.slope[lane][j]);
      }
    }
  }

 private:
  Jet patched(const Jet& value, int foot, Jet PatchOf<Jet>::*by) const { return patches.empty() ? value : value * (patches[foot].*by); }

  ActingLaws plain_;
  std::vector<Jet> fixed_, registers_;
  std::vector<Dual<Row, 2>> rows_;
  std::vector<Dual<Row, LANES>> spread_, wide_;  // as ``fixed_`` and registers, for eight nodes
};

// Friction of a foot that slides at the nodes of a step, as the run has it: its slopes by the arguments of the law, and by lanes
// what it has by the law's parameters.
struct SlidingTangent {
  Row by[FRICTION_ARGUMENTS], own[LANES];
};

// speed [m/s]: in the sense of the slip.
inline SlidingTangent sliding_tangent(LawTangents& laws, int foot, const Row& margin, const Row& strength, const Row& speed, bool begins) {
  SlidingTangent out;
  std::copy_n(sliding_bound(laws.plain(), foot, margin, strength, speed, begins).slope, FRICTION_ARGUMENTS, out.by);
  if (!laws.patches.empty()) {
    for (Row& by : out.by) by = by * laws.patches[foot].friction.value;
  }
  const auto own = mirrored(speed, begins, [&](const Row& at, const Row&) { return laws.friction(foot, margin, strength, at); });
  std::copy_n(own.slope, LANES, out.own);
  return out;
}

// A square matrix once eliminated, for right sides of eight lanes.
class Factored {
 public:
  // ``matrix`` (size, size); false where it is singular.
  bool factor(const std::vector<double>& matrix, int size) {
    begin(size);
    for (int r = 0; r < size; r++) std::copy_n(&matrix[size_t(r) * size], size, row(r));
    return eliminate();
  }

  // Room for a matrix of zeros, to be filled row by row (each of ``size`` numbers) and eliminated.
  void begin(int size) {
    size_ = size;
    width_ = (size + N - 1) / N;
    rows_.assign(size_t(size) * width_, Row(0.0));
    lower_.resize(size_t(size) * size);
    order_.resize(size);
    inverse_.resize(size);
  }
  double* row(int r) { return reinterpret_cast<double*>(&rows_[size_t(r) * width_]); }

  bool eliminate() {
    const int size = size_;
    for (int c = 0; c < size; c++) {
      int best = c;
      for (int r = c + 1; r < size; r++) {
        if (std::fabs(row(r)[c]) > std::fabs(row(best)[c])) best = r;
      }
      const double pivot = row(best)[c];
      if (!(std::fabs(pivot) > 0.0)) return false;
      order_[c] = best;
      inverse_[c] = 1.0 / pivot;
      if (best != c) {
        for (int j = 0; j < width_; j++) std::swap(rows_[size_t(best) * width_ + j], rows_[size_t(c) * width_ + j]);
        for (int j = 0; j < c; j++) std::swap(lower_[size_t(best) * size + j], lower_[size_t(c) * size + j]);
      }
      for (int r = c + 1; r < size; r++) {
        const double factor = lower_[size_t(r) * size + c] = row(r)[c] * inverse_[c];
        if (factor == 0.0) continue;
        for (int j = c / N; j < width_; j++) rows_[size_t(r) * width_ + j] -= rows_[size_t(c) * width_ + j] * factor;
      }
    }
    return true;
  }

  template <class Number>
  void solve(Number* x) const {
    for (int c = 0; c < size_; c++) std::swap(x[c], x[order_[c]]);
    for (int c = 0; c < size_; c++) {
      for (int r = c + 1; r < size_; r++) x[r] -= x[c] * lower_[size_t(r) * size_ + c];
    }
    for (int c = size_ - 1; c >= 0; c--) {
      x[c] = x[c] * inverse_[c];
      for (int r = 0; r < c; r++) x[r] -= x[c] * row(r)[c];
    }
  }

  // By the transposed matrix.
  void solve_transposed(Row* x) const {
    for (int c = 0; c < size_; c++) {
      const double* upper = row(c);
      x[c] = x[c] * inverse_[c];
      for (int r = c + 1; r < size_; r++) x[r] -= x[c] * upper[r];
    }
    for (int c = size_ - 1; c > 0; c--) {
      for (int r = 0; r < c; r++) x[r] -= x[c] * lower_[size_t(c) * size_ + r];
    }
    for (int c = size_ - 1; c >= 0; c--) std::swap(x[c], x[order_[c]]);
  }

 private:
  int size_ = 0, width_ = 0;      // width: of a row of the matrix, in rows of the machine
  std::vector<Row> rows_;         // what is left of the matrix: its upper triangle counts
  std::vector<double> lower_, inverse_;
  std::vector<int> order_;

  const double* row(int r) const { return reinterpret_cast<const double*>(&rows_[size_t(r) * width_]); }
};

}  // namespace tarsus
