// Derivatives of a recorded run of a modal robot: a march over its own steps and events (see docs/gradients.md).
//
// Between events the state's tangents at fixed times are those of the collocated solution. At an event the state is taken
// along with its moment, which moves by dt = -dg / (dg/dt): Dw = dw + w' dt before it, the map of the event on Jets, and
// dw = Dw - w' dt after it.
#pragma once
#include "modal_replay.hpp"
#include "rules.hpp"
#include "tangent.hpp"
#include "window.hpp"

namespace tarsus {

// Why a derivative is not to be had, or from one side only.
enum Doubtful { GRAZING = 1, SIMULTANEOUS = 2, AT_THRESHOLD = 3, LOST = 4, EDGE_AT_START = 5 };

struct TangentFlag {
  double event, reason, lane;  // lane -1: all
};

// What a run came to and its data; ``since``: of the contacts at its start.
struct RunRecord {
  const double* trace;
  size_t rows;
  const Event* events;
  const Note* notes;
  size_t count;
};

struct TangentResult {
  std::vector<Row> events, samples;  // (events, EVENT_WIDTH), (times, sample width less held)
  std::vector<Row> steps;            // (rows, 1 + 2 stride + 8 inputs): end of the step [s], its start state and inputs
  std::vector<TangentFlag> flags;
};

class ModalTangent {
 public:
  ModalTangent(Book& book, const Nodes& nodes, const Halves& halves, const Signals& signals, const Laws& laws,
               const Settings& settings, const RunData& run, const Beginning& start, const DataTangents& data, size_t channels)
      : book_(book), sizes_(book.sizes), nodes_(nodes), halves_(halves), settings_(settings.of(run)), run_(run), data_(data),
        laws_(laws, run.parameters, data), drives_(signals, nodes, data, run, channels), mode_(nullptr),
        dw_(sizes_.state(), Row(0.0)), feet_(sizes_.feet), channel_values_(channels * N), channel_slopes_(channels * N),
        channels_(channels), value_(sizes_), slope_(sizes_), plain_sources_(run.sources, run.sources + sizes_.sources()) {
    const Sizes& s = sizes_;
    value_.sources = plain_sources_;
    slope_.sources = data.sources;
    for (int q = 0; q < s.sources(); q++) sources_.push_back(jet(run.sources[q], data.sources[q]));
    FootSet on(s.feet);
    std::vector<Jet> place;
    for (int r = 0; r < 2 * s.coordinates; r++) place.push_back(jet(run.initial[r], data.initial[r]));
    for (int i = 0; i < s.feet; i++) {
      if (start.held[i]) on.toggle(i);
      feet_[i].since = jet(start.since[i], data.since[i]);
    }
    time_ = Jet(start.time);
    moving_ = true;
    for (size_t c = 0; c < channels; c++) drives_.player.seek(int(c), start.time);
    note_drives();
    enter(book.require(on), place);
  }

  TangentResult run(const RunRecord& record, const double* times, size_t count, bool keep) {
    TangentResult out;
    out.events.assign(record.count * EVENT_WIDTH, Row(0.0));
    out.samples.assign(count * (sample_width(sizes_) - sizes_.feet), Row(0.0));
    record_ = &record;
    out_ = &out;
    size_t event = 0, sample = 0;
    flag_edges();
    event = happen(event, 0);
    for (size_t r = 0; r < record.rows; r++) {
      const Recorded step = recorded(book_, record.trace + r * recorded_width(sizes_));
      if (step.mode != mode_) {
        lose(event);
        break;
      }
      begin_step(step);
      linearise(step);
      if (keep) keep_step();
      const double end = step.time + step.length * step.fraction;
      const bool last = r + 1 == record.rows;
      while (sample < count && (last || times[sample] < record.trace[(r + 1) * recorded_width(sizes_)])) {
        take_sample(step, std::min(std::max((times[sample] - step.time) / step.length, 0.0), step.fraction), sample);
        sample++;
      }
      track(step, event);
      end_step(step, end);
      event = happen(event, r + 1);
    }
    return out;
  }

 private:
  struct FootTangent {
    Jet since;
    Row apex = Row(0.0), apex_time = Row(0.0), integral = Row(0.0);
  };

  Book& book_;
  const Sizes sizes_;
  const Nodes& nodes_;
  const Halves& halves_;
  const Settings settings_;
  const RunData run_;
  const DataTangents& data_;
  LawTangents laws_;
  DriveTangents drives_;
  const ContactMode* mode_;
  std::vector<Row> dw_;  // tangents of the flowing state at the present, fixed time
  std::vector<FootTangent> feet_;
  std::vector<double> channel_values_;  // (channels, 8) at the nodes of the step
  std::vector<Row> channel_slopes_;
  size_t channels_;
  Entering<double> value_;
  Entering<Row> slope_;
  const std::vector<double> plain_sources_;
  std::vector<double> end_, state_rate_;  // the flowing state at the end of a step, and its rate there
  std::vector<int> acting_;
  std::vector<Row> gap_slopes_;  // (feet, 8)
  std::vector<Jet> sources_;
  // an instant: the moving state and time, and what inputs were just before
  bool moving_ = false;
  Jet time_;
  std::vector<Jet> w_;
  std::vector<Jet> drives_now_;  // of every channel
  std::vector<int> struck_;
  Row shared_ = Row(0.0);  // derivative of the moment of the last event or moving kink
  double shared_at_ = -INF;
  double fraction_ = 0.0, length_ = 1.0;  // of the step that has ended, and its tables
  const StepClass* tables_ = nullptr;
  const RunRecord* record_ = nullptr;
  TangentResult* out_ = nullptr;

  Row biased(const double* unit, int count, int row) const {
    Row sum = Row(0.0);
    for (int q = 0; q < sizes_.sources(); q++) sum += data_.sources[q] * unit[q * count + row];
    return sum;
  }
  Jet biased_jet(const double* unit, int count, int row) const {
    Jet sum(0.0);
    for (int q = 0; q < sizes_.sources(); q++) sum = sum + sources_[q] * unit[q * count + row];
    return sum;
  }
  Jet along(const double* rows, int row, const std::vector<Jet>& x) const {
    Jet sum(0.0);
    for (int k = 0; k < sizes_.state(); k++) sum = sum + x[k] * rows[row * sizes_.state() + k];
    return sum;
  }
  Jet gap_of(int i) const { return along(mode_->outputs, i, w_) + biased_jet(mode_->bias_feed, 2 * sizes_.feet, i); }
  int channel_of(int foot) const { return int(laws_.laws.volts[foot]); }

  // ---- a step

  // Inputs and state at the start of a step; an instant ends, and kinks whose time moves pass.
  void begin_step(const Recorded& step) {
    const int ns = sizes_.stride, nb = mode_->blocks_used;
    acting_ = acting_inputs(*mode_, laws_.plain());
    std::fill(value_.state.begin(), value_.state.end(), 0.0);
    std::copy(step.state, step.state + nb, value_.state.begin());
    std::copy(step.state + nb, step.state + 2 * nb, value_.state.begin() + ns);
    std::copy(step.inputs, step.inputs + value_.inputs.size(), value_.inputs.begin());
    const std::vector<Cursor> left = drives_.player.cursor;
    for (size_t c = 0; c < channels_; c++) {
      drives_.fill(int(c), step.time, step.length, &channel_values_[N * c], &channel_slopes_[N * c]);
    }
    if (!moving_) pass_kinks(step, left);
    if (!moving_) return;
    std::vector<double> values(sizes_.inputs(), 0.0), rate;
    for (int i : acting_) values[i] = value_.input(i)[0];
    rate_of_state(*mode_, acting_, value_.state, values, value_.sources, rate);
    for (int k = 0; k < sizes_.state(); k++) dw_[k] = slope_of(w_[k]) - slope_of(time_) * rate[k];
    moving_ = false;
  }

  // A channel that has jumped where its kink's time moves shifts the state by the difference of its rates.
  void pass_kinks(const Recorded& step, const std::vector<Cursor>& left) {
    for (size_t c = 0; c < channels_; c++) {
      const Cursor &was = left[c], &now = drives_.player.cursor[c];
      if (was.piece == now.piece && was.turns == now.turns) continue;
      const Jet kink = drives_.beginning(int(c), now);
      // within the rounding of the player; what lies further back is no kink, and nothing jumps there
      const double rounding = 2e-12 * (drives_.signals.end[was.piece] - drives_.signals.start[was.piece]) + 1e-14 * step.time;
      if (std::fabs(kink.value - step.time) > rounding) continue;
      shared_ = slope_of(kink);
      shared_at_ = step.time;
      if (!any_less(Row(0.0), magnitude(shared_))) continue;
      const double before = drives_.value(int(c), was, Jet(step.time)).value, after = channel_values_[N * c];
      if (int(c) < sizes_.drives) {
        const double* row = mode_->inputs + size_t(2 * sizes_.feet + c) * sizes_.state();
        for (int k = 0; k < sizes_.state(); k++) dw_[k] += shared_ * (row[k] * (before - after));
      }
      for (int i : mode_->free) {
        if (!laws_.has(i, HAS_FORCE) || channel_of(i) != int(c)) continue;
        const double gap = plain_gap(i, value_.state), speed = plain_rate(i);
        const double jump = force_at(i, gap, speed, before, step.time) - force_at(i, gap, speed, after, step.time);
        const double* row = mode_->inputs + size_t(sizes_.feet + i) * sizes_.state();
        for (int k = 0; k < sizes_.state(); k++) dw_[k] += shared_ * (row[k] * jump);
      }
    }
  }

  double force_at(int i, double gap, double rate, double volts, double time) {
    return laws_.force(i, Jet(gap), Jet(rate), Jet(volts), Jet(time)).value;
  }
  double plain_gap(int i, const std::vector<double>& state) const {
    double sum = dot(mode_->outputs + size_t(i) * sizes_.state(), state);
    for (int q = 0; q < sizes_.sources(); q++) sum += run_.sources[q] * mode_->bias_feed[q * 2 * sizes_.feet + i];
    return sum;
  }
  double plain_rate(int i) const {
    std::vector<double> y = value_.state;
    for (int k : mode_->free) {
      const double p = value_.input(k)[0];
      for (int r = 0; r < sizes_.state(); r++) y[r] += mode_->beta[k * sizes_.state() + r] * p;
    }
    return dot(mode_->outputs + size_t(sizes_.feet + i) * sizes_.state(), y);
  }

  // Tangents of the nodal inputs: the drives' own, and the smooth forces' from (1 - S G) d = S dlinear + explicit part, with
  // S their slopes by gap and rate, and G what they do to those.
  void linearise(const Recorded& step) {
    tables_ = &book_.step(*mode_, step.step_class);
    const StepClass& tables = *tables_;
    const int m = sizes_.feet;
    std::fill(slope_.inputs.begin(), slope_.inputs.end(), Row(0.0));
    slope_.state = dw_;
    for (int d = 0; d < sizes_.drives; d++) {
      std::copy_n(&channel_slopes_[N * d], N, slope_.input(2 * m + d));
    }
    std::vector<int> smooth, outputs;
    for (int i : acting_) {
      if (i < 2 * m) smooth.push_back(i);
    }
    if (!smooth.empty()) solve_smooth(step, tables, smooth);
    gap_slopes_.assign(size_t(m) * N, Row(0.0));
    for (int i : mode_->free) outputs_at_nodes(tables, acting_, slope_, i, &gap_slopes_[N * i]);
  }

  void solve_smooth(const Recorded& step, const StepClass& tables, const std::vector<int>& smooth) {
    const int m = sizes_.feet, size = int(smooth.size()) * N;
    std::vector<double> matrix(size_t(size) * size, 0.0), line(2 * N);
    std::vector<Row> right(size), linear(2 * N), by_gap(smooth.size()), by_rate(smooth.size());
    for (size_t a = 0; a < smooth.size(); a++) {
      const int i = smooth[a], foot = i % m;
      const bool force = i >= m, rated = force && laws_.has(foot, USES_RATE);
      outputs_at_nodes(tables, acting_, value_, foot, line.data());
      outputs_at_nodes(tables, acting_, slope_, foot, linear.data());
      if (rated) {
        outputs_at_nodes(tables, acting_, value_, m + foot, line.data() + N);
        outputs_at_nodes(tables, acting_, slope_, m + foot, linear.data() + N);
      }
      const Row gap = load(line.data()), rate = rated ? load(line.data() + N) : Row(0.0);
      const int channel = force ? channel_of(foot) : -1;
      const Row volts = channel < 0 ? Row(0.0) : load(&channel_values_[N * channel]);
      const Row arguments[4] = {gap, rate, volts, nodes_.times() * step.length + step.time};
      laws_.slopes(force ? FORCE : MOMENTUM, foot, arguments, force ? 4 : 1, by_gap[a], by_rate[a]);
      if (!rated) by_rate[a] = Row(0.0);
      for (int j = 0; j < N; j++) {
        Row& to = right[a * N + j];
        to = linear[j] * by_gap[a][j];
        if (rated) to += linear[N + j] * by_rate[a][j];
        if (!laws_.varied[foot] && channel < 0) continue;
        const Jet at(gap[j]), u = channel < 0 ? Jet(0.0) : jet(volts[j], channel_slopes_[N * channel + j]);
        const Jet found = force ? laws_.force(foot, at, Jet(rate[j]), u, Jet(arguments[3][j])) : laws_.momentum(foot, at);
        if (std::isfinite(found.value)) to += slope_of(found);
      }
    }
    for (size_t a = 0; a < smooth.size(); a++) {
      const int foot = smooth[a] % m;
      for (size_t b = 0; b < smooth.size(); b++) {
        const double* effect = tables.from_input(foot, smooth[b]);
        const double* rated = any_less(Row(0.0), magnitude(by_rate[a])) ? tables.from_input(m + foot, smooth[b]) : nullptr;
        for (int j = 0; j < N; j++) {
          for (int l = 0; l < N; l++) {
            double& to = matrix[(a * N + j) * size + b * N + l];
            to = (a == b && j == l) - by_gap[a][j] * effect[l * N + j];
            if (rated != nullptr) to -= by_rate[a][j] * rated[l * N + j];
          }
        }
      }
    }
    Factored solver;
    if (!solver.factor(std::move(matrix), size)) return lose(0);
    solver.solve(right.data());
    for (size_t a = 0; a < smooth.size(); a++) std::copy_n(&right[a * N], N, slope_.input(smooth[a]));
  }

  void keep_step() {
    std::vector<Row>& to = out_->steps;
    to.push_back(Row(0.0));  // of its end: set where an event ends it
    to.insert(to.end(), slope_.state.begin(), slope_.state.end());
    to.insert(to.end(), slope_.inputs.begin(), slope_.inputs.end());
  }

  void take_sample(const Recorded& step, double s, size_t n) {
    std::vector<Row> state;
    within_step(book_, nodes_, halves_, *mode_, step.step_class, s, acting_, slope_, state);
    Shown<Row> shown(sizes_);
    show(*mode_, nodes_, step.length, s, acting_, slope_, state, shown);
    Row* to = out_->samples.data() + n * (sample_width(sizes_) - sizes_.feet);
    to = std::copy(shown.place.begin(), shown.place.end(), to);
    for (const auto* part : {&shown.gap, &shown.rate, &shown.resistive, &shown.smooth, &shown.pull}) {
      to = std::copy(part->begin(), part->end(), to);
    }
  }

  // The highest gap of the flights that end next, and integrals of the gaps: what of them lies in this step.
  void track(const Recorded& step, size_t event) {
    for (int i : mode_->free) {
      const Row* line = &gap_slopes_[N * i];
      double power = step.fraction * step.length;
      for (int c = 0; c < N; c++, power *= step.fraction) {
        Row k = Row(0.0);
        for (int j = 0; j < N; j++) k += line[j] * nodes_.monomial[c][j];
        feet_[i].integral += k * (power / (c + 1));
      }
      size_t next = event;
      while (next < record_->count && record_->events[next].foot != i) next++;
      if (next == record_->count) continue;
      const double when = record_->events[next].apex_time, s = (when - step.time) / step.length;
      if (!(s >= 0.0 && s <= step.fraction) || !(record_->events[next].apex > 0.0)) continue;
      Entering<Row> gap(sizes_);
      std::copy_n(line, N, gap.input(0));
      Row value, slope, bend;
      gap.at(nodes_, 0, s, value, slope, bend);
      feet_[i].apex = value;
      Entering<double> plain(sizes_);
      outputs_at_nodes(*tables_, acting_, value_, i, plain.input(0));
      double height, rate, curve;
      plain.at(nodes_, 0, s, height, rate, curve);
      const bool inside = s < step.fraction && curve < 0.0;
      feet_[i].apex_time = inside ? slope * (-step.length / curve) : Row(0.0);
    }
  }

  // The state and its rate at the end of a step, inputs as they are just before it.
  void end_step(const Recorded& step, double end) {
    std::vector<Row> state;
    std::vector<double> plain;
    if (step.fraction == 1.0) {
      end_of_step(*tables_, acting_, slope_, state);
      end_of_step(*tables_, acting_, value_, plain);
    } else {
      within_step(book_, nodes_, halves_, *mode_, step.step_class, step.fraction, acting_, slope_, state);
      within_step(book_, nodes_, halves_, *mode_, step.step_class, step.fraction, acting_, value_, plain);
    }
    dw_ = state;
    end_ = plain;
    fraction_ = step.fraction;
    length_ = step.length;
    time_ = Jet(end);
    std::vector<double> values(sizes_.inputs(), 0.0);
    double slope, bend;
    for (int i : acting_) value_.at(nodes_, i, step.fraction, values[i], slope, bend);
    rate_of_state(*mode_, acting_, plain, values, value_.sources, state_rate_);
  }

  // ---- events

  bool same_instant(size_t event, size_t steps) const {
    return event < record_->count && record_->notes[event].steps == double(steps);
  }

  // All events that happened when so many steps had been recorded. Returns the number of the next event.
  size_t happen(size_t event, size_t steps) {
    struck_.clear();
    for (; same_instant(event, steps); event++) {
      const Event& e = record_->events[event];
      if (record_->notes[event].origin == MARKED) {
        note_mark(event);
        continue;
      }
      if (!moving_) begin_instant(event, steps);
      apply(event, e);
    }
    return event;
  }

  void note_mark(size_t event) {
    const int i = int(record_->events[event].foot);
    Row* to = &out_->events[event * EVENT_WIDTH];
    FootTangent& foot = feet_[i];
    const Row shift = data_.period * std::round(record_->events[event].time / settings_.period);
    to[0] = std::isfinite(settings_.period) ? shift : Row(0.0);
    to[9] = foot.apex;
    to[10] = foot.apex_time;
    to[11] = foot.integral;
    foot.apex = foot.apex_time = Row(0.0);
  }

  // The first event of an instant: how its moment moves, and the state with it.
  void begin_instant(size_t event, size_t steps) {
    const Event& e = record_->events[event];
    int foot = int(e.foot);
    // an impact may have torn this foot off first: then it is the impact's moment
    if (e.kind == RELEASE && same_instant(event + 1, steps)) {
      const Event& next = record_->events[event + 1];
      const int other = int(next.foot);
      if (next.kind != RELEASE && next.kind != CONTACT_AT_START && other != foot && !mode_->is_held[other] && at_ground(other)) foot = other;
    }
    Row moved;
    if (fraction_ == 0.0 && shared_at_ >= time_.value - settings_.least_progress) {
      moved = shared_;
    } else {
      const Slope found = mode_->is_held[foot] ? margin_slope(foot) : gap_slope(foot);
      moved = -found.by / found.rate;
      if (found.grazes) flag(event, GRAZING, -1);
      shared_ = moved;
      shared_at_ = time_.value;
    }
    time_ = jet(time_.value, moved);
    w_.clear();
    for (int k = 0; k < sizes_.state(); k++) w_.push_back(jet(end_[k], dw_[k] + moved * state_rate_[k]));
    note_drives();
    if (!out_->steps.empty()) out_->steps[out_->steps.size() - kept_width()] = moved;
    moving_ = true;
  }

  void note_drives() {
    drives_now_.clear();
    for (size_t c = 0; c < channels_; c++) drives_now_.push_back(drive_at(int(c), time_));
  }
  Jet drive_at(int c, const Jet& time) const { return c < 0 ? Jet(0.0) : drives_.value(c, drives_.player.cursor[c], time); }

  size_t kept_width() const { return 1 + slope_.state.size() + slope_.inputs.size(); }

  struct Slope {
    Row by;       // at a fixed time
    double rate;  // by time
    bool grazes;
  };

  bool at_ground(int i) const { return std::fabs(plain_gap(i, end_)) <= 10.0 * (settings_.gap_zero + settings_.gap); }

  // The gap of a free foot. It grazes where it would dip below the ground by no more than what gaps may err by.
  Slope gap_slope(int i) const {
    const double* row = mode_->outputs + size_t(i) * sizes_.state();
    const double rate = dot(row, state_rate_);
    const Row by = dot(row, dw_) + biased(mode_->bias_feed, 2 * sizes_.feet, i);
    Entering<double> plain(sizes_);
    double value, slope, bend;
    outputs_at_nodes(*tables_, acting_, value_, i, plain.input(0));
    plain.at(nodes_, 0, fraction_, value, slope, bend);
    const double curve = bend / (length_ * length_);
    return {by, rate, curve > 0.0 && 0.5 * rate * rate < GRAZE * settings_.gap * curve};
  }
  static constexpr double GRAZE = 100.0;  // errors of a gap that a dip below the ground must exceed

  // What still holds a held foot: strength less smooth force less pull.
  Slope margin_slope(int i) {
    const int m = sizes_.feet, ni = sizes_.inputs();
    const double* row = mode_->outputs + size_t(i) * sizes_.state();
    Row by = -(dot(row, dw_) + biased(mode_->bias_feed, 2 * m, i));
    double rate = -dot(row, state_rate_);
    for (int k : acting_) {
      const double direct = mode_->feed[i * ni + k], fast = mode_->feed_rate[i * ni + k] / length_;
      if (direct == 0.0 && fast == 0.0) continue;
      double v, v1, v2;
      Row d, d1, d2;
      value_.at(nodes_, k, fraction_, v, v1, v2);
      slope_.at(nodes_, k, fraction_, d, d1, d2);
      by -= d * direct + d1 * fast;
      rate -= (v1 * direct + v2 * fast) / length_;
    }
    // the contact's own part at a fixed time, and by time
    const int c = channel_of(i);
    const Jet now(time_.value), later = jet(time_.value, Row(1.0)), volts = drive_at(c, now);
    by += slope_of(holds(i, now - feet_[i].since, volts, now));
    const Jet age(now.value - feet_[i].since.value), still(volts.value);
    const Jet rising = jet(volts.value, slope_of(drive_at(c, later)) - slope_of(volts));
    rate += (slope_of(holds(i, jet(age.value, Row(1.0)), rising, later)) - slope_of(holds(i, age, still, now)))[0];
    return {by, rate, std::fabs(rate) <= 1e-9 * run_.scales[1] / settings_.end};
  }

  // Pull that breaks the contact of a held foot off.
  Jet holds(int i, const Jet& age, const Jet& volts, const Jet& time) {
    Jet out(0.0);
    if (laws_.has(i, HAS_LATCH)) out = laws_.value(STRENGTH, i, {age});
    if (laws_.has(i, HAS_FORCE)) out = out - laws_.force(i, Jet(0.0), Jet(0.0), volts, time);
    return out;
  }

  // The modal state: the flowing one and the film momenta of the free feet, that of ``struck`` at the ground.
  std::vector<Jet> modal(int struck, double sign = 1.0) {
    std::vector<Jet> y = w_;
    for (int i : mode_->free) {
      if (!laws_.has(i, HAS_MOMENTUM)) continue;
      const Jet gap = gap_of(i), p = laws_.momentum(i, i == struck ? gap - gap.value : gap) * sign;
      for (int k = 0; k < sizes_.state(); k++) y[k] = y[k] + p * mode_->beta[i * sizes_.state() + k];
    }
    return y;
  }

  Jet foot_volts(int i) const { return channel_of(i) < 0 ? Jet(0.0) : drives_now_[channel_of(i)]; }

  Jet pull_if_held(int foot, const std::vector<Jet>& y) {
    const int m = sizes_.feet;
    const double* feed = mode_->held_feed + size_t(foot) * sizes_.inputs();
    Jet pull = along(mode_->held_rows, foot, y) + biased_jet(mode_->bias_held, m, foot);
    for (int d = 0; d < sizes_.drives; d++) {
      if (feed[2 * m + d] != 0.0) pull = pull + drives_now_[d] * feed[2 * m + d];
    }
    if (laws_.has(foot, HAS_FORCE)) pull = pull + laws_.force(foot, Jet(0.0), Jet(0.0), foot_volts(foot), time_);
    for (int k : mode_->free) {
      const double factor = feed[m + k];
      if (factor == 0.0 || k == foot) continue;
      const Jet rate = along(mode_->outputs, m + k, y), gap = gap_of(k);
      if (laws_.has(k, HAS_MOMENTUM)) pull = pull + rate * laws_.momentum_slope(k, gap, settings_.probe) * factor;
      if (laws_.has(k, HAS_FORCE)) pull = pull + laws_.force(k, gap, rate, foot_volts(k), time_) * factor;
    }
    return pull;
  }

  Jet new_strength(int i) { return laws_.has(i, HAS_LATCH) ? laws_.value(STRENGTH, i, {Jet(0.0)}) : Jet(0.0); }

  // Numbers of an event: time, foot, kind, before, after, pull, strength, energy, adhesion.
  void put(size_t event, const Jet& time, std::initializer_list<Jet> numbers) {
    Row* to = &out_->events[event * EVENT_WIDTH];
    FootTangent& foot = feet_[int(record_->events[event].foot)];
    to[0] = slope_of(time);
    int n = 3;
    for (const Jet& one : numbers) to[n++] = slope_of(one);
    to[9] = foot.apex;
    to[10] = foot.apex_time;
    to[11] = foot.integral;
    foot.apex = Row(0.0);
    foot.apex_time = slope_of(time_);
  }

  void apply(size_t event, const Event& e) {
    const int foot = int(e.foot), kind = int(e.kind);
    if (kind == RELEASE) {
      const Jet strength = laws_.has(foot, HAS_LATCH) && e.strength != 0.0 ? laws_.value(STRENGTH, foot, {time_ - feet_[foot].since}) : Jet(0.0);
      put(event, time_, {Jet(0.0), Jet(0.0), strength, strength, Jet(0.0), Jet(0.0)});
      return change_mode(foot, -1);
    }
    if (kind == CONTACT_AT_START) {
      const std::vector<Jet> y = modal(-1);
      put(event, time_, {Jet(0.0), Jet(0.0), pull_if_held(foot, y), new_strength(foot), Jet(0.0), Jet(0.0)});
      feet_[foot].since = time_;
      return change_mode(foot, -1);
    }
    land(event, e, foot);
  }

  // An impact. Where it is the second of two at one moment that need not stay together, each has its own moment if they do not
  // touch each other, and else there is no derivative.
  void land(size_t event, const Event& e, int foot) {
    Row apart = Row(0.0);
    const Row off = coincidence(foot);
    const bool separate = any_less(Row(0.0), magnitude(off));
    if (separate) {
      const std::vector<Jet> y = modal(foot);
      const double rate = along(mode_->outputs, sizes_.feet + foot, y).value;
      if (independent(foot)) {
        apart = -off / rate;
        shift_moment(apart);
      } else {
        for (int lane = 0; lane < LANES; lane++) {
          if (off[lane] != 0.0) flag(event, SIMULTANEOUS, lane);
        }
      }
    }
    strike(event, e, foot);
    if (separate) shift_moment(-apart);
    struck_.push_back(foot);
  }

  // How the gap of a foot that lands moves at an instant, where it does: beyond rounding of its terms.
  Row coincidence(int foot) const {
    const double* row = mode_->outputs + size_t(foot) * sizes_.state();
    const Row found = slope_of(gap_of(foot));
    Row size = Row(0.0);
    for (int k = 0; k < sizes_.state(); k++) size += magnitude(slope_of(w_[k])) * std::fabs(row[k]);
    Row out = Row(0.0);
    for (int lane = 0; lane < LANES; lane++) {
      if (std::fabs(found[lane]) > 1e-6 * size[lane]) out.set(lane, found[lane]);
    }
    return out;
  }

  bool independent(int foot) const {
    for (int other : struck_) {
      if (mode_->is_held[other]) return false;
      const double* row = mode_->outputs + size_t(sizes_.feet + foot) * sizes_.state();
      double there = 0.0;
      for (int k = 0; k < sizes_.state(); k++) there += row[k] * mode_->jump[other * sizes_.state() + k];
      if (std::fabs(there) > 1e-12) return false;
    }
    return true;
  }

  // Take the state along to a moment that moves otherwise.
  void shift_moment(const Row& by) {
    const int m = sizes_.feet;
    const std::vector<int> acting = acting_inputs(*mode_, laws_.plain());
    const std::vector<Jet> y = modal(-1);
    std::vector<double> values(sizes_.inputs(), 0.0), plain, rate;
    for (const Jet& one : w_) plain.push_back(one.value);
    for (int i : acting) {
      if (i < m) {
        values[i] = laws_.momentum(i, gap_of(i)).value;
      } else if (i < 2 * m) {
        values[i] = laws_.force(i - m, gap_of(i - m), along(mode_->outputs, i, y), foot_volts(i - m), time_).value;
      } else {
        values[i] = drives_now_[i - 2 * m].value;
      }
    }
    rate_of_state(*mode_, acting, plain, values, plain_sources_, rate);
    for (int k = 0; k < sizes_.state(); k++) w_[k] = jet(w_[k].value, slope_of(w_[k]) + by * rate[k]);
    time_ = jet(time_.value, slope_of(time_) + by);
  }

  void strike(size_t event, const Event& e, int foot) {
    const int kind = int(e.kind);
    const std::vector<Jet> y = modal(foot);
    const Jet rate = along(mode_->outputs, sizes_.feet + foot, y), speed = -rate;
    const Jet after = laws_.value(REBOUND, foot, {speed});
    const Jet pull = pull_if_held(foot, y), strength = new_strength(foot);
    const double mobility = mode_->mobility[foot];
    const Jet lost = (speed * speed - after * after) * (0.5 / mobility), kept = after * after * (0.5 / mobility);
    if (laws_.has(foot, RESTITUTES_FIRST)) {
      const Jet excess = laws_.value(EXCESS, foot, {after});
      if (std::fabs(excess.value) < CLOSE * std::fabs(after.value)) flag(event, AT_THRESHOLD, -1);
    }
    const bool decided = laws_.has(foot, HAS_LATCH) && !laws_.has(foot, PULL_AS_PRINTED);
    if (decided && std::fabs(pull.value - strength.value) < CLOSE * (std::fabs(pull.value) + strength.value)) flag(event, AT_THRESHOLD, -1);
    if (kind != BOUNCE) {
      const Jet taken = kind == CAPTURE && laws_.has(foot, HAS_LATCH) ? kept : Jet(0.0);
      Jet over = time_;
      if (kind == REST && after.value > 0.0) {
        const Jet ratio = speed.value > 0.0 ? minimum(after / speed, Jet(0.999999)) : Jet(0.0);
        over = time_ - after * 2.0 / (pull * mobility) / (1.0 - ratio);
      }
      put(event, over, {speed, Jet(0.0), pull, strength, lost + kept, taken});
      feet_[foot].since = time_;
      return change_mode(foot, foot);
    }
    put(event, time_, {speed, after, pull, strength, lost + follow(foot, speed, after, y), Jet(0.0)});
    const Jet change = after - rate;
    for (int k = 0; k < sizes_.state(); k++) w_[k] = w_[k] + change * mode_->jump[foot * sizes_.state() + k];
  }
  static constexpr double CLOSE = 1e-7;  // part of a force or speed that a decision must be away from its threshold

  // How the structure follows an impact across the normal (see follow_impact); the energy that takes.
  Jet follow(int foot, const Jet& speed, const Jet& after, const std::vector<Jet>& y) {
    const double skew = mode_->skew[foot];
    if (skew == 0.0 || speed.value == 0.0) return Jet(0.0);
    const Jet e = after / speed;
    Jet alpha(1.0), beta = (e + 1.0) * skew;
    if (!laws_.has(foot, MAP_AS_IS)) {
      const Jet theta = passive(e, skew);
      alpha = cosine(theta);
      beta = square_root(maximum(1.0 - e * e, Jet(0.0))) * sine(theta);
    }
    const Jet before = along(mode_->side_rate, foot, y);
    const Jet then = alpha * before + beta * speed / std::sqrt(mode_->mobility[foot]);
    const Jet change = then - before;
    for (int k = 0; k < sizes_.state(); k++) w_[k] = w_[k] + change * mode_->side[foot * sizes_.state() + k];
    return (before * before - then * then) * 0.5;
  }

  // passive_angle with its derivative, by one step of Newton's method on Jets from its value.
  static Jet passive(const Jet& e, double skew) {
    const Jet theta(passive_angle(e.value, skew));
    if (e.value >= 1.0) return theta;
    const Jet wanted = (e + 1.0) * skew * square_root(1.0 - e * e), sine_ = sine(theta), cosine_ = cosine(theta);
    const Jet f = sine_ * (1.0 - e * e * cosine_) - wanted * cosine_;
    const double c = cosine_.value, s = sine_.value, ee = e.value * e.value;
    return jet(theta.value, -slope_of(f) / (c * (1.0 - ee * c) + ee * s * s + wanted.value * s));
  }

  // To the contact mode with one foot more or less on the ground.
  void change_mode(int foot, int struck) {
    const std::vector<Jet> y = modal(struck);
    std::vector<Jet> place;
    for (int r = 0; r < 2 * sizes_.coordinates; r++) {
      place.push_back(along(mode_->to_physical, r, y) + biased_jet(mode_->bias_offset, 2 * sizes_.coordinates, r));
    }
    enter(book_.toggled(*mode_, foot), place);
  }

  void enter(const ContactMode& mode, const std::vector<Jet>& place) {
    mode_ = &mode;
    const int n2 = 2 * sizes_.coordinates;
    std::vector<Jet> off;
    for (int r = 0; r < n2; r++) off.push_back(place[r] - biased_jet(mode.bias_offset, n2, r));
    w_.assign(sizes_.state(), Jet(0.0));
    for (int k = 0; k < sizes_.state(); k++) {
      for (int r = 0; r < n2; r++) w_[k] = w_[k] + off[r] * mode.from_physical[k * n2 + r];
    }
    w_ = modal(-1, -1.0);
  }

  // Edges of drives that lie at the very start and move: on one side they have an effect there.
  void flag_edges() {
    const Signals& s = drives_.signals;
    for (size_t c = 0; c < channels_; c++) {
      const Cursor& at = drives_.player.cursor[c];
      const int64_t before = at.piece > at.first + std::max<int64_t>(at.loop, 0) ? at.piece - 1 : at.loop >= 0 ? at.behind - 1 : -1;
      const Jet edge = drives_.beginning(int(c), at);
      const double length = s.end[at.piece] - s.start[at.piece];
      if (before < 0 || std::fabs(edge.value - time_.value) > 1e-12 * length + 1e-14 * time_.value) continue;
      double jump = -s.coef[DEGREE * at.piece];
      for (int k = 0; k < DEGREE; k++) jump += s.coef[DEGREE * before + k] - (k % 2 ? -1.0 : 1.0) * s.coef[DEGREE * at.piece + k] * (k > 0);
      if (std::fabs(jump) <= 1e-9 * s.span[chosen(c)]) continue;
      for (int lane = 0; lane < LANES; lane++) {
        if (edge.slope[lane] != 0.0) flag(0, EDGE_AT_START, lane);
      }
    }
  }
  size_t chosen(size_t c) const { return size_t(run_.channels[c]); }

  void flag(size_t event, Doubtful reason, int lane) { out_->flags.push_back({double(event), double(reason), double(lane)}); }
  void lose(size_t event) {
    flag(event, LOST, -1);
    for (Row& one : dw_) one = Row(NOT_A_NUMBER);
  }
};

}  // namespace tarsus
