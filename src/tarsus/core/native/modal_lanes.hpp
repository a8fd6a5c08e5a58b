// One step of up to eight runs of a batch at once, a run a lane: structures with one foot in one contact mode and step
// class, in the air under a film alone or held by a strength that grows with time, under drives that are constant.
//
// The arithmetic is that of attempt_free, attempt_held and scan_one in the same order, so that a run comes out the same to
// the last bit whether it is alone or has neighbours. Where a step is more than quiet (too long, an event in it, the end
// of what is ahead), the run goes on by itself from what its lane has found.
#pragma once
#include "modal_system.hpp"

namespace tarsus {

// What lanes read of a run: these numbers, then its state, rest gap, gravity and drives. WANTED: see Trial. SINCE: age of a
// contact [s]; in the air least_rise.
enum Given { THICKNESS, HALF, TOLERANCE, PER_GAP, INITIAL, RATE, SINCE, WANTED };

// A run of a batch and the step it tries. While quiet steps follow each other it lives in what lanes read alone; ``settle``
// tells the rest of it.
template <class S>
struct LaneRun : ModalSystem<S> {
  std::vector<Row> rows;
  double time = 0.0, until = 0.0;  // [s] now, and up to where quiet steps can follow each other
  int64_t quiet = 0, most = 0;     // such steps, made and left
  Trial trial = {};
  bool whole = false, first = false;  // the step ends before anything is due; it is the first in a contact mode
  size_t number = 0;                  // of the run in its batch
  Ahead before = {};                  // what is ahead of it

  template <class... Parts>
  explicit LaneRun(Parts&&... parts) : ModalSystem<S>(std::forward<Parts>(parts)...) {
    const Sizes& sizes = this->sizes;
    rows.assign((N + sizes.state() + sizes.sources() + sizes.drives + N - 1) / N, Row(0.0));
  }

  double* given() { return reinterpret_cast<double*>(rows.data()); }
  double* flowing() { return given() + N; }
  double* inputs() { return flowing() + this->sizes.state(); }

  void begin(size_t run, const RunData& data) {
    ModalSystem<S>::begin(data);
    number = run;
    const OneFoot& one = this->one;
    const double numbers[] = {one.thickness, one.half, 0.05 * this->settings.gap, this->per_gap, one.initial, one.rate};
    std::copy(numbers, numbers + SINCE, given());
    std::copy(data.sources, data.sources + this->sizes.sources(), inputs());
  }

  // Whether the next trial can be made in a lane.
  bool waits() {
    const bool held = this->mode->free.empty();
    if (!(held ? this->one.in_line : this->one.in_film) || !fit(*this, before, trial)) return false;
    const double h = this->book.lengths[trial.k];
    time = this->clock.time;
    this->drive(time, h);
    if (!this->steady) return false;
    until = std::min(before.goal, this->player.calm_until());
    quiet = 0;
    most = this->settings.most_steps - this->clock.steps;
    whole = h <= before.left;
    first = this->launching;
    given()[SINCE] = held ? time - this->feet[0].since : least_rise(this->feet[0].departure);
    given()[WANTED] = trial.wanted;
    std::copy(this->state(), this->state() + this->sizes.state(), flowing());
    for (int d = 0; d < this->sizes.drives; d++) inputs()[this->sizes.sources() + d] = this->value(2 + d)[0];
    return true;
  }

  // The same after a quiet step in the air, where nothing else has changed.
  TARSUS_INLINE bool waits_again() {
    if (!(this->book.lengths[trial.k] <= until - time) || quiet >= most) return false;
    quiet++;
    given()[WANTED] = trial.k;
    given()[SINCE] = 0.0;
    whole = true;
    return true;
  }

  // After quiet steps: where they have led.
  void settle() {
    if (time == this->clock.time) return;
    this->clock.time = time;
    this->clock.steps += quiet;
    most -= quiet;
    quiet = 0;
    this->step_class = trial.k;
    this->feet[0].departure = UNDER_WAY;
    std::copy(flowing(), flowing() + this->sizes.state(), this->state());
  }
};

TARSUS_INLINE Row length_of(const Row& x, const Row& y) {
  Row out;
  for (int p = 0; p < PARTS; p++) out.part[p] = Shape<WIDTH, 1>::length(x.part[p], y.part[p]);
  return out;
}

// Sum of a row's entries that lie in the rows of eight runs, in the order of ``total``.
TARSUS_INLINE Row total_of(const Row* rows) {
  return ((rows[0] + rows[4]) + (rows[2] + rows[6])) + ((rows[1] + rows[5]) + (rows[3] + rows[7]));
}

template <class S>
class Lanes {
 public:
  typedef LaneRun<S> Run;

  Lanes(const Sizes& sizes, const Nodes& nodes) : sizes_(sizes), nodes_(nodes), ns_(S::stride(sizes.stride)), end_(2 * ns_) {}

  // One trial of ``count`` runs, all of one contact mode and step class.
  void attempt(Run** runs, int count) {
    for (int l = 0; l < N; l++) runs_[l] = runs[l < count ? l : 0];
    mode_ = runs_[0]->mode;
    step_ = &runs_[0]->book.step(*mode_, runs_[0]->trial.k);
    gather();
    if (mode_->is_held[0]) {
      hold();
    } else {
      fall();
    }
    flow();
    choose();
    by_lane_ = false;
  }

  // What it came to for one of them.
  enum Result { QUIET, TAKEN, AGAIN };  // a full step without an event; see ``taken``; the next trial is shorter

  Result close(int lane, Taken& taken) {
    Run& m = *runs_[lane];
    const double error = at(error_, lane), h = step_->length;
    if (quiet_[lane] && m.whole && (mode_->is_held[0] || !m.settings.track || shows_peak(lane, m))) {
      for (int r = 0; r < 2 * ns_; r++) m.flowing()[r] = at(end_[r], lane);
      m.time += h;
      if (m.first) note_launch(m, m.trial, error);
      m.first = false;
      m.trial.k = int(at(next_, lane));
      return QUIET;
    }
    const int k = m.trial.k;
    m.settle();
    turn_to_lanes();
    m.room[0] = 0.0;
    m.outputs[0] = m.margin[0] = margins_[lane];
    m.linear[0].set(N - 1, at(linear_[N - 1], lane));
    if (deep_[lane]) {
      m.room[0] = at(linear_[0], lane) + m.one.thickness;
      runs_deep(m, 0, m.outputs[0]);
    }
    if (rejects(m, error, m.trial)) return AGAIN;
    const bool grown = !mode_->is_held[0] && error > 0.0;
    m.values[0] = films_[lane];
    m.growth_before = grown ? std::fabs(m.values[0][0]) : 1.0;
    m.growth_after = grown ? std::fabs(m.values[0][N - 1]) : 1.0;
    m.take_class(k);
    const Scan seen = scan_bounded(m, at(bound_, lane), limit_of(*step_, m.before));
    return take<S>(m, *step_, seen, error, m.before, m.trial, taken) ? TAKEN : AGAIN;
  }

 private:
  const Sizes sizes_;
  const Nodes& nodes_;
  const int ns_;
  Run* runs_[N];
  const ContactMode* mode_ = nullptr;
  const StepClass* step_ = nullptr;
  std::vector<Row> numbers_, end_;  // what is read, and the state at the end: by number, a row of lanes each
  Row linear_[N], gap_[N], film_[N], margin_[N];  // by node
  Row margins_[N], films_[N];                     // by lane
  Row error_, bound_, next_;
  Mask deep_, quiet_;
  bool by_lane_ = false;  // whether there are rows by lane

  static double at(const Row& row, int lane) { return reinterpret_cast<const double*>(&row)[lane]; }
  static Row column(const Row* rows, int lane) {
    Row out;
    for (int j = 0; j < N; j++) out.set(j, at(rows[j], lane));
    return out;
  }
  const Row& given(Given number) const { return numbers_[number]; }
  const Row& x(int b) const { return numbers_[N + b]; }
  const Row& y(int b) const { return numbers_[N + ns_ + b]; }
  const Row& source(int s) const { return numbers_[N + 2 * ns_ + s]; }
  const Row& drive(int d) const { return numbers_[N + 2 * ns_ + sizes_.sources() + d]; }

  // Margins and films of the runs: what more than a quiet step needs.
  void turn_to_lanes() {
    if (by_lane_) return;
    by_lane_ = true;
    for (int j = 0; j < N; j++) {
      margins_[j] = margin()[j];
      films_[j] = film_[j];
    }
    transpose(margins_);
    transpose(films_);
  }

  // Whether no peak of a flight hides between the nodes; then it is noted.
  bool shows_peak(int lane, Run& m) {
    m.settle();
    turn_to_lanes();
    m.outputs[0] = margins_[lane];
    if (hides_peak(m, 0, at(bound_, lane), 1.0)) return false;
    raise_apexes(m, *step_, 1.0);
    return true;
  }

  const Row* margin() const { return mode_->is_held[0] ? margin_ : gap_; }
  TARSUS_INLINE void gather() {
    const size_t rows = runs_[0]->rows.size();
    numbers_.resize(rows * N);
    for (size_t r = 0; r < rows; r++) {
      for (int l = 0; l < N; l++) numbers_[r * N + l] = runs_[l]->rows[r];
      transpose(&numbers_[r * N]);
    }
  }

  // What rest gaps and gravity add, from tables per unit of each.
  TARSUS_INLINE Row biased(const double* units, int stride) const {
    Row sum = Row(0.0);
    for (int s = 0; s < sizes_.sources(); s++) sum += source(s) * units[s * stride];
    return sum;
  }

  // Outputs at the nodes without smooth forces: flowing_output.
  TARSUS_INLINE void run_freely() {
    const int nb = mode_->blocks_used, stride = sizes_.outputs * N;
    const double* table = step_->from_state(0);
    Row even[N], odd[N];
#pragma GCC unroll 8
    for (int j = 0; j < N; j++) {
      even[j] = biased(step_->node_bias + j, stride);
      odd[j] = Row(0.0);
    }
    for (int b = 0; b < nb; b++) {
      const Row x = this->x(b), y = this->y(b);
#pragma GCC unroll 8
      for (int j = 0; j < N; j++) {
        even[j] += table[2 * N * b + j] * x;
        odd[j] += table[2 * N * b + N + j] * y;
      }
    }
    for (int d = 0; d < sizes_.drives; d++) {
      const double* constant = step_->node_constant + (2 + d) * N;
#pragma GCC unroll 8
      for (int j = 0; j < N; j++) even[j] += constant[j] * drive(d);
    }
#pragma GCC unroll 8
    for (int j = 0; j < N; j++) linear_[j] = even[j] + odd[j];
  }

  void hold() {
    run_freely();
    const Row initial = given(INITIAL), rate = given(RATE), age = given(SINCE), h = Row(step_->length);
    for (int j = 0; j < N; j++) {
      gap_[j] = linear_[j];
      margin_[j] = (initial + rate * (age + Row(nodes_.tau[j]) * h)) - linear_[j];
      film_[j] = Row(0.0);
    }
    error_ = Row(0.0);
    deep_ = Mask();
    look(Row(0.0));
  }

  void fall() {
    run_freely();
    const double *constant = step_->node_constant, last = constant[N - 1], reach = step_->reach[0];
    const Row thickness = given(THICKNESS), half = given(HALF), first = linear_[0], height = first + thickness;
    const Row inverse = 1.0 / height, held = half * inverse * inverse;
    const Mask stiff = below(Row(STIFFNESS), 2.0 * held * magnitude(inverse * last));
    const Row floor = first - DEEP * height;
    deep_ = Mask();
    for (int j = 0; j < N; j++) {
      gap_[j] = linear_[j] + constant[j] * held;
      deep_ = deep_ | below(gap_[j], floor);
    }
    deep_ = deep_ & below(Row(0.0), half) & ~stiff;
    Mask settled = sweep(~(stiff | deep_));
    for (int l = 0; bool(stiff) && l < N; l++) {
      if (stiff[l]) solve(l, settled);
    }
    Row parts[N], high = film_[0], low = film_[0];
    for (int j = 0; j < N; j++) {
      parts[j] = rounded_product(film_[j], Row(nodes_.tail[j]));
      high = larger(high, film_[j]);
      low = smaller(low, film_[j]);
    }
    const Row swing = magnitude(gap_[N - 1] - gap_[0]), all = magnitude(total_of(parts)) * reach;
    const Row yielding = all * (swing / (swing + reach * magnitude(film_[N - 1] - film_[0])));
    error_ = pick(settled, pick(below(Row(0.0), swing), yielding, all) * given(PER_GAP), Row(UNSETTLED));
    look(high - low);
  }

  // sweep_one for the lanes ``active``. Returns which settled.
  TARSUS_INLINE Mask sweep(Mask active) {
    const double* effect = step_->from_input(0, 0);
    const Row thickness = given(THICKNESS), half = given(HALF), tolerance = given(TOLERANCE);
    Row inverse[N], tried[N], change[N], before = Row(INF);
    Mask settled, late;
    for (int j = 0; j < N; j++) inverse[j] = tried[j] = change[j] = Row(0.0);
    for (int n = 0; n < SWEEPS && bool(active); n++) {
      for (int j = 0; j < N; j++) {
        Row one, scaled;
        reciprocals(gap_[j] + thickness, half, one, scaled);
        inverse[j] = pick(active, one, inverse[j]);
        tried[j] = pick(active, scaled * one, tried[j]);
      }
      Row most = Row(0.0), sum = Row(0.0);
      for (int j = 0; j < N; j++) {
        const double rows[N] = {effect[j],         effect[N + j],     effect[2 * N + j], effect[3 * N + j],
                                effect[4 * N + j], effect[5 * N + j], effect[6 * N + j], effect[7 * N + j]};
        const Row found = combined(linear_[j], rows, tried), by = found - gap_[j], moved = magnitude(by);
        most = larger(most, moved);
        sum += moved;
        change[j] = pick(active, by, change[j]);
        gap_[j] = pick(active, found, gap_[j]);
      }
      const Mask sound = active & at_most(sum, Row(1e300));  // no NaN, which ``most`` would pass over
      const Mask still = sound & at_most(most, tolerance);
      Mask slow = Mask();
      if (n > 0) slow = sound & ~still & at_most(most * most, tolerance * larger(before - most, Row(0.0)));
      settled = settled | still | slow;
      late = late | slow;
      active = sound & ~still & ~slow;
      if (n > 2) active = active & ~below(0.7 * before, most);
      before = most;
    }
    for (int j = 0; j < N; j++) film_[j] = film_after(tried[j], inverse[j], change[j]);
    if (late) {
      for (int j = 0; j < N; j++) {
        Row one, scaled;
        reciprocals(gap_[j] + thickness, half, one, scaled);
        film_[j] = pick(late, scaled * one, film_[j]);
      }
    }
    return settled;
  }

  // A lane whose film is stiff, by itself.
  TARSUS_APART void solve(int lane, Mask& settled) {
    Row gap, film;
    Run& m = *runs_[lane];
    if (!solve_stiff(m, m.one, *step_, m.clock.time, column(linear_, lane), gap, film)) return;
    for (int j = 0; j < N; j++) {
      gap_[j].set(lane, gap[j]);
      film_[j].set(lane, film[j]);
    }
    Row one = Row(0.0);
    one.set(lane, 1.0);
    settled = settled | below(Row(0.0), one);
  }

  // A block (p, q) times a matrix of it: tarsus::turn.
  TARSUS_INLINE void turn(const double* matrix, const Row& p, const Row& q, Row& x, Row& y) const {
    x = y = Row(0.0);
    x += matrix[0] * p;
    y += matrix[2 * ns_] * p;
    x += matrix[ns_] * q;
    y += matrix[3 * ns_] * q;
  }

  // The bound of what the margin does between nodes, and whether it leaves no doubt: block_speeds and chord_bound.
  TARSUS_INLINE void look(const Row& range) {
    const bool held = mode_->is_held[0];
    const int ns = ns_, size = 2 * ns, pack = S::WIDTH;
    Row sums[S::WIDTH];
    for (int w = 0; w < pack; w++) sums[w] = Row(0.0);
    for (int b = 0; b < ns; b++) {
      const Row &p = this->x(b), &q = this->y(b);
      Row x, y, change = Row(0.0);
      turn(mode_->blocks + b, p, q, x, y);
      x += biased(mode_->bias_inputs + b, size);
      y += biased(mode_->bias_inputs + ns + b, size);
      if (!held) {
        x += mode_->inputs[b] * film_[0];
        y += mode_->inputs[ns + b] * film_[0];
        change += mode_->input_norm[b] * range;
      }
      for (int d = 0; d < sizes_.drives; d++) {
        const double* input = mode_->inputs + (2 + d) * size;
        x += input[b] * drive(d);
        y += input[ns + b] * drive(d);
      }
      sums[b % pack] += step_->envelope[b] * (length_of(x, y) + change);
    }
    bound_ = sums[0];
    for (int w = 1; w < pack; w++) bound_ += sums[w];
    quiet_ = at_most(Row(0.0), error_) & at_most(error_, Row(1.0));
    for (int j = 1; j < N; j++) quiet_ = quiet_ & at_most(bound_, margin()[j]);
    // as find_doubt; where this leaves a doubt, that decides
    const Mask high = at_most(bound_, margin()[0]), leaves = held ? Mask() : below(Row(0.0), given(SINCE));
    const Mask rises = below(given(SINCE) * (bound_ * runs_[0]->chord[1]), margin()[1]);
    quiet_ = quiet_ & ((leaves & rises) | (~leaves & high));
  }

  // State at the end of the whole step: tarsus::flow.
  TARSUS_INLINE void flow() {
    const int ns = ns_, size = 2 * ns;
    const bool held = mode_->is_held[0];
    Row zero = Row(0.0);
    for (int b = 0; b < ns; b++) {
      const Row &p = this->x(b), &q = this->y(b);
      Row x, y;
      turn(step_->exponential + b, p, q, x, y);
      x += biased(step_->state_bias + b, size);
      y += biased(step_->state_bias + ns + b, size);
      if (!held) {
        const double* table = step_->state_input + b;
#pragma GCC unroll 8
        for (int j = 0; j < N; j++) {
          x += table[j * size] * film_[j];
          y += table[j * size + ns] * film_[j];
        }
      }
      for (int d = 0; d < sizes_.drives; d++) {
        const double* steady = step_->state_constant + (2 + d) * size + b;
        x += steady[0] * drive(d);
        y += steady[ns] * drive(d);
      }
      end_[b] = x;
      end_[ns + b] = y;
      zero += (x + y) * 0.0;
    }
    quiet_ = quiet_ & at_most(zero, Row(0.0));  // not where a number is none
  }

  // Class to try next after a quiet step: next_class.
  TARSUS_INLINE void choose() {
    const std::vector<double>& lengths = runs_[0]->book.lengths;
    const bool held = mode_->is_held[0];
    const Row k = Row(step_->number), last = Row(double(lengths.size()) - 1.0), wanted = given(WANTED), *m = margin();
    Row expected = error_, one = Row(1.0);
    if (!held) {
      const Mask grown = below(Row(0.0), error_);
      const Row before = pick(grown, magnitude(film_[0]), one), after = pick(grown, magnitude(film_[N - 1]), one);
      expected = error_ * after * after;
      one = before * before;
    }
    Row longer = k;
    for (double share : LONGER) longer -= pick(below(expected, share * one), Row(1.0), Row(0.0));
    next_ = pick(at_most(k, wanted), larger(longer, Row(0.0)), wanted);
    next_ = smaller(pick(below(SHORTER * one, expected), larger(wanted, k + Row(1.0)), next_), last);
    Row length;
    for (int l = 0; l < N; l++) length.set(l, lengths[int(next_[l])]);
    const double dt = (nodes_.tau[N - 1] - nodes_.tau[N - 2]) * step_->length;
    const Row drop = m[N - 2] - m[N - 1], ahead = m[N - 1] * dt;
    const Mask falling = below(Row(0.0), drop);
    if (!held) {
      const Row film = film_[N - 1] - film_[N - 2], room = FILM_GROWTH * film_[N - 1] * dt;
      shorten(falling & below(Row(0.0), film), film, room, last, length);
    }
    shorten(falling, drop, ahead, Row(mode_->landing_class), length);
  }

  // Go down to where length * rate <= room, in ``lanes``, but not beyond the class ``last``.
  TARSUS_INLINE void shorten(Mask lanes, const Row& rate, const Row& room, const Row& last, Row& length) {
    for (;;) {
      lanes = lanes & below(room, length * rate) & below(next_, last);
      if (!lanes) return;
      next_ = pick(lanes, next_ + Row(1.0), next_);
      length = pick(lanes, length * 0.5, length);
    }
  }
};

}  // namespace tarsus
