// Derivatives of a recorded run of a modal robot: a march over its own steps and events (see docs/gradients.md).
//
// Between events the state's tangents at fixed times are those of the collocated solution. At an event the state is taken
// along with its moment, which moves by dt = -dg / (dg/dt): Dw = dw + w' dt before it, the map of the event on Jets, and
// dw = Dw - w' dt after it.
#pragma once
#include "tangent_shadow.hpp"
#include "window.hpp"

namespace tarsus::modal {

// Why a derivative is not to be had, or from one side only. APART: events or kinks of one moment move apart, so that what is
// integrated over the steps between them has no derivative here; all else has.
enum Doubtful { GRAZING = 1, SIMULTANEOUS = 2, AT_THRESHOLD = 3, LOST = 4, EDGE_AT_START = 5, APART = 6 };

struct TangentFlag {
  double event, reason, lane;  // lane -1: all
};

// What a run came to: recorded steps, events and notes on them.
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
  // ``beside``: structures for the lanes whose numbers are the structure's own.
  ModalTangent(Book& book, const Nodes& nodes, const Halves& halves, const Signals& signals, const Laws& laws,
               const Settings& settings, const RunData& run, const Beginning& start, const DataTangents& data, size_t channels,
               const std::vector<Beside>& beside)
      : book_(book), sizes_(book.sizes), nodes_(nodes), halves_(halves), settings_(settings.of(run)), run_(run), data_(data),
        laws_(laws, run.parameters, data), drives_(signals, nodes, data, run, channels),
        now_(book, laws_, settings_, sources_of(run, data, book.sizes)), dw_(sizes_.state(), Row(0.0)), feet_(sizes_.feet),
        channel_values_(channels * N), channel_slopes_(channels * N), channels_(channels), value_(sizes_), slope_(sizes_) {
    value_.sources.assign(run.sources, run.sources + sizes_.sources());
    slope_.sources = data.sources;
    FootSet on(sizes_.feet);
    std::vector<Jet> place;
    for (int r = 0; r < 2 * sizes_.coordinates; r++) place.push_back(jet(run.initial[r], data.initial[r]));
    for (int i = 0; i < sizes_.feet; i++) {
      if (start.held[i]) on.toggle(i);
      now_.since[i] = jet(start.since[i], data.since[i]);
    }
    for (size_t c = 0; c < channels; c++) drives_.player.seek(int(c), start.time);
    now_.time = Jet(start.time);
    note_drives();
    now_.enter(book.require(on), place);
    for (const Beside& one : beside) shadows_.emplace_back(one, laws_, settings_);
    for (Shadow& one : shadows_) one.begin_instant(now_, place);
    moving_ = true;
  }

  TangentResult run(const RunRecord& record, const double* times, size_t count, bool keep) {
    TangentResult out;
    out.events.assign(record.count * EVENT_WIDTH, Row(0.0));
    out.samples.assign(count * (sample_width(sizes_) - sizes_.feet), Row(0.0));
    record_ = &record;
    out_ = &out;
    size_t sample = 0;
    flag_edges();
    size_t event = happen(0, 0);
    for (size_t r = 0; r < record.rows; r++) {
      const Recorded step = recorded(book_, record.trace + r * recorded_width(sizes_));
      if (step.mode != now_.mode) {
        lose(event);
        break;
      }
      begin_step(step);
      linearise(step);
      if (keep) keep_step();
      const bool last = r + 1 == record.rows;
      while (sample < count && (last || times[sample] < record.trace[(r + 1) * recorded_width(sizes_)])) {
        take_sample(step, std::min(std::max((times[sample] - step.time) / step.length, 0.0), step.fraction), sample);
        sample++;
      }
      track(step, event);
      end_step(step);
      event = happen(event, r + 1);
    }
    return out;
  }

 private:
  struct FootTangent {
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
  Instant now_;
  std::vector<Shadow> shadows_;
  bool moving_ = false;   // within an instant
  std::vector<Row> dw_;   // tangents of the flowing state at the present, fixed time
  std::vector<FootTangent> feet_;
  std::vector<double> channel_values_;  // (channels, 8) at the nodes of the step
  std::vector<Row> channel_slopes_;
  size_t channels_;
  Entering<double> value_;  // what enters the step, and its tangents
  Entering<Row> slope_;
  std::vector<int> acting_;
  std::vector<Row> gap_slopes_;  // (feet, 8)
  std::vector<double> end_, rate_;  // the flowing state at the end of the step, and its rate there
  const StepClass* tables_ = nullptr;
  Recorded step_ = {};
  std::vector<int> struck_;  // feet that have landed in this instant
  int first_foot_ = -1;      // whose event this instant is
  size_t event_ = 0;         // the next one
  Row shared_ = Row(0.0);  // derivative of the moment of the last event or moving kink, and that moment [s]
  double shared_at_ = -INF;
  const RunRecord* record_ = nullptr;
  TangentResult* out_ = nullptr;

  static std::vector<Jet> sources_of(const RunData& run, const DataTangents& data, const Sizes& sizes) {
    std::vector<Jet> out;
    for (int q = 0; q < sizes.sources(); q++) out.push_back(jet(run.sources[q], data.sources[q]));
    return out;
  }
  int channel_of(int foot) const { return int(laws_.laws.volts[foot]); }
  Jet drive_at(int c, const Jet& time) const { return c < 0 ? Jet(0.0) : drives_.value(c, drives_.player.cursor[c], time); }
  void note_drives() {
    now_.drives.clear();
    for (size_t c = 0; c < channels_; c++) now_.drives.push_back(drive_at(int(c), now_.time));
  }

  // ---- a step

  // Inputs and state at the start of a step; an instant ends, and kinks whose time moves pass.
  void begin_step(const Recorded& step) {
    const ContactMode& mode = *now_.mode;
    const int ns = sizes_.stride, nb = mode.blocks_used;
    step_ = step;
    acting_ = acting_inputs(mode, laws_.plain());
    std::fill(value_.state.begin(), value_.state.end(), 0.0);
    std::copy(step.state, step.state + nb, value_.state.begin());
    std::copy(step.state + nb, step.state + 2 * nb, value_.state.begin() + ns);
    std::copy(step.inputs, step.inputs + value_.inputs.size(), value_.inputs.begin());
    const std::vector<Cursor> left = drives_.player.cursor;
    for (size_t c = 0; c < channels_; c++) {
      drives_.fill(int(c), step.time, step.length, &channel_values_[N * c], &channel_slopes_[N * c]);
    }
    if (moving_) {
      end_instant();
    } else {
      pass_kinks(left);
    }
    if (shadows_.empty()) return;
    Shown<double> shown(sizes_);
    show(mode, nodes_, step.length, 0.0, acting_, value_, value_.state, shown);
    for (Shadow& one : shadows_) one.begin_step(mode, step.step_class, shown.place, value_);
  }

  void end_instant() {
    const ContactMode& mode = *now_.mode;
    std::vector<double> values(sizes_.inputs(), 0.0), rate;
    for (int i : acting_) values[i] = value_.input(i)[0];
    rate_of_state(mode, acting_, value_.state, values, value_.sources, rate);
    for (int k = 0; k < sizes_.state(); k++) dw_[k] = slope_of(now_.w[k]) - slope_of(now_.time) * rate[k];
    for (Shadow& one : shadows_) {
      add_place(one, one.instant.place());
      add_momenta(one, -1.0, dw_);
    }
    moving_ = false;
  }

  // What a shadow makes of displacements and velocities, as a part of the state's tangents in its lane.
  template <class Number>
  void add_place(const Shadow& one, const std::vector<Number>& place) {
    for (int k = 0; k < sizes_.state(); k++) {
      double sum = 0.0;
      for (size_t r = 0; r < place.size(); r++) sum += now_.mode->from_physical[k * place.size() + r] * number(place[r]);
      one.add(sum, dw_[k]);
    }
  }
  static double number(double x) { return x; }
  static double number(const Jet& x) { return x.value; }

  // And of the film momenta: the gaps of its free feet differ.
  void add_momenta(const Shadow& one, double sign, std::vector<Row>& to) {
    for (int i : now_.mode->free) {
      if (!laws_.has(i, HAS_MOMENTUM)) continue;
      const double slope = laws_.momentum_slope(i, now_.gap_of(i), settings_.probe).value * sign * one.instant.gap_of(i).value;
      for (int k = 0; k < sizes_.state(); k++) one.add(slope * now_.mode->beta[i * sizes_.state() + k], to[k]);
    }
  }

  // A channel that has jumped where its kink's time moves shifts the state by the difference of its rates.
  void pass_kinks(const std::vector<Cursor>& left) {
    const Signals& signals = drives_.signals;
    for (size_t c = 0; c < channels_; c++) {
      const Cursor &was = left[c], &now = drives_.player.cursor[c];
      if (was.piece == now.piece && was.turns == now.turns) continue;
      const Jet kink = drives_.beginning(int(c), now);
      // within the rounding of the player; what lies further back is no kink, and nothing jumps there
      const double rounding = 2e-12 * (signals.end[was.piece] - signals.start[was.piece]) + 1e-14 * step_.time;
      if (std::fabs(kink.value - step_.time) > rounding) continue;
      for (int lane = 0; lane < LANES && shared_at_ == step_.time; lane++) {
        if (std::fabs(shared_[lane] - kink.slope[lane]) > 1e-9 * std::fabs(kink.slope[lane])) flag(event_, APART, lane);
      }
      shared_ = slope_of(kink);
      shared_at_ = step_.time;
      if (!any_less(Row(0.0), magnitude(shared_))) continue;
      if (!out_->steps.empty()) out_->steps[out_->steps.size() - kept_width()] = shared_;
      pass_jump(int(c), drives_.value(int(c), was, Jet(step_.time)).value, channel_values_[N * c]);
    }
  }

  void pass_jump(int c, double before, double after) {
    const int m = sizes_.feet;
    const auto push = [&](int input, double by) {
      const double* row = now_.mode->inputs + size_t(input) * sizes_.state();
      for (int k = 0; k < sizes_.state(); k++) dw_[k] += shared_ * (row[k] * by);
    };
    if (c < sizes_.drives) push(2 * m + c, before - after);
    for (int i : now_.mode->free) {
      if (!laws_.has(i, HAS_FORCE) || channel_of(i) != c) continue;
      Shown<double> shown(sizes_);
      show(*now_.mode, nodes_, step_.length, 0.0, acting_, value_, value_.state, shown);
      const Jet gap(shown.gap[i]), rate(shown.rate[i]), time(step_.time);
      push(m + i, laws_.force(i, gap, rate, Jet(before), time).value - laws_.force(i, gap, rate, Jet(after), time).value);
    }
  }

  // Tangents of the nodal inputs: the drives' own, and the smooth forces' from (1 - S G) d = S dlinear + explicit part, with
  // S their slopes by gap and rate, and G what they do to those.
  void linearise(const Recorded& step) {
    tables_ = &book_.step(*now_.mode, step.step_class);
    const int m = sizes_.feet;
    std::fill(slope_.inputs.begin(), slope_.inputs.end(), Row(0.0));
    slope_.state = dw_;
    for (int d = 0; d < sizes_.drives; d++) std::copy_n(&channel_slopes_[N * d], N, slope_.input(2 * m + d));
    std::vector<int> smooth;
    for (int i : acting_) {
      if (i < 2 * m) smooth.push_back(i);
    }
    if (!smooth.empty()) solve_smooth(step, smooth);
    gap_slopes_.assign(size_t(m) * N, Row(0.0));
    for (int i : now_.mode->free) output_slopes(i, &gap_slopes_[N * i]);
  }

  void output_slopes(int output, Row* to) const {
    outputs_at_nodes(*tables_, acting_, slope_, output, to);
    for (const Shadow& one : shadows_) one.add_outputs(acting_, output, to);
  }

  // One smooth input: its slopes at the nodes, and its tangents at fixed smooth inputs.
  struct Smooth {
    int foot;
    bool rated;
    Row by_gap, by_rate, right[N];
  };

  void solve_smooth(const Recorded& step, const std::vector<int>& smooth) {
    const int m = sizes_.feet, size = int(smooth.size()) * N;
    std::vector<Smooth> all;
    for (int i : smooth) all.push_back(smooth_input(step, i));
    std::vector<double> matrix(size_t(size) * size, 0.0);
    std::vector<Row> right;
    for (size_t a = 0; a < all.size(); a++) {
      const Smooth& one = all[a];
      right.insert(right.end(), one.right, one.right + N);
      for (size_t b = 0; b < all.size(); b++) {
        const double* by_gap = tables_->from_input(one.foot, smooth[b]);
        const double* by_rate = one.rated ? tables_->from_input(m + one.foot, smooth[b]) : nullptr;
        for (int j = 0; j < N; j++) {
          for (int l = 0; l < N; l++) {
            double& to = matrix[(a * N + j) * size + b * N + l];
            to = (a == b && j == l) - one.by_gap[j] * by_gap[l * N + j];
            if (one.rated) to -= one.by_rate[j] * by_rate[l * N + j];
          }
        }
      }
    }
    Factored solver;
    if (!solver.factor(std::move(matrix), size)) return lose(event_);
    solver.solve(right.data());
    for (size_t a = 0; a < all.size(); a++) std::copy_n(&right[a * N], N, slope_.input(smooth[a]));
  }

  Smooth smooth_input(const Recorded& step, int i) {
    const int m = sizes_.feet, foot = i % m;
    const bool force = i >= m;
    Smooth out = {foot, force && laws_.has(foot, USES_RATE), Row(0.0), Row(0.0), {}};
    double gap[N], rate[N] = {};
    Row gaps[N], rates[N];
    outputs_at_nodes(*tables_, acting_, value_, foot, gap);
    output_slopes(foot, gaps);
    if (out.rated) {
      outputs_at_nodes(*tables_, acting_, value_, m + foot, rate);
      output_slopes(m + foot, rates);
    }
    const int c = force ? channel_of(foot) : -1;
    const Row volts = c < 0 ? Row(0.0) : load(&channel_values_[N * c]), times = nodes_.times() * step.length + step.time;
    const Row arguments[4] = {load(gap), load(rate), volts, times};
    laws_.slopes(force ? FORCE : MOMENTUM, foot, arguments, force ? 4 : 1, out.by_gap, out.by_rate);
    for (int j = 0; j < N; j++) {
      out.right[j] = gaps[j] * out.by_gap[j];
      if (out.rated) out.right[j] += rates[j] * out.by_rate[j];
      if (!laws_.varied[foot] && c < 0) continue;
      const Jet u = c < 0 ? Jet(0.0) : jet(volts[j], channel_slopes_[N * c + j]);
      const Jet found = force ? laws_.force(foot, Jet(gap[j]), Jet(rate[j]), u, Jet(times[j])) : laws_.momentum(foot, Jet(gap[j]));
      if (std::isfinite(found.value)) out.right[j] += slope_of(found);
    }
    return out;
  }

  size_t kept_width() const { return 1 + slope_.state.size() + slope_.inputs.size(); }
  void keep_step() {
    std::vector<Row>& to = out_->steps;
    to.push_back(Row(0.0));  // of its end: set where an event or a kink ends it
    to.insert(to.end(), slope_.state.begin(), slope_.state.end());
    to.insert(to.end(), slope_.inputs.begin(), slope_.inputs.end());
  }

  // Tangents of what is shown at scaled time s of the step.
  Shown<Row> shown_at(const Recorded& step, double s) const {
    std::vector<Row> state;
    within_step(book_, nodes_, halves_, *now_.mode, step.step_class, s, acting_, slope_, state);
    Shown<Row> out(sizes_);
    show(*now_.mode, nodes_, step.length, s, acting_, slope_, state, out);
    for (const Shadow& one : shadows_) {
      const Shown<double> own = one.at(nodes_, halves_, step.length, s, acting_);
      for (size_t r = 0; r < own.place.size(); r++) one.add(own.place[r], out.place[r]);
      for (int i = 0; i < sizes_.feet; i++) {
        one.add(own.gap[i], out.gap[i]);
        one.add(own.rate[i], out.rate[i]);
        one.add(own.pull[i], out.pull[i]);
      }
    }
    return out;
  }

  void take_sample(const Recorded& step, double s, size_t n) {
    const Shown<Row> shown = shown_at(step, s);
    Row* to = out_->samples.data() + n * (sample_width(sizes_) - sizes_.feet);
    to = std::copy(shown.place.begin(), shown.place.end(), to);
    for (const auto* part : {&shown.gap, &shown.rate, &shown.resistive, &shown.smooth, &shown.pull}) {
      to = std::copy(part->begin(), part->end(), to);
    }
  }

  // The highest gap of the flights that end next, and integrals of the gaps: what of them lies in this step.
  void track(const Recorded& step, size_t event) {
    for (int i : now_.mode->free) {
      const Row* line = &gap_slopes_[N * i];
      double power = step.fraction * step.length;
      for (int c = 0; c < N; c++, power *= step.fraction) {
        Row k = Row(0.0);
        for (int j = 0; j < N; j++) k += line[j] * nodes_.monomial[c][j];
        feet_[i].integral += k * (power / (c + 1));
      }
      size_t next = event;
      while (next < record_->count && record_->events[next].foot != i) next++;
      if (next == record_->count || !(record_->events[next].apex > 0.0)) continue;
      const double s = (record_->events[next].apex_time - step.time) / step.length;
      if (s >= 0.0 && s <= step.fraction) note_apex(step, i, s);
    }
  }

  void note_apex(const Recorded& step, int i, double s) {
    Entering<Row> gap(sizes_);
    std::copy_n(&gap_slopes_[N * i], N, gap.input(0));
    Row value, slope, bend;
    gap.at(nodes_, 0, s, value, slope, bend);
    feet_[i].apex = value;
    const bool inside = s < step.fraction && bend_of(i, s) < 0.0;
    feet_[i].apex_time = inside ? slope * (-step.length / bend_of(i, s)) : Row(0.0);
  }

  // Second derivative of a gap by the scaled time.
  double bend_of(int i, double s) const {
    Entering<double> plain(sizes_);
    outputs_at_nodes(*tables_, acting_, value_, i, plain.input(0));
    double value, slope, bend;
    plain.at(nodes_, 0, s, value, slope, bend);
    return bend;
  }

  // The state and its rate at the end of a step, inputs as they are just before it.
  void end_step(const Recorded& step) {
    if (step.fraction == 1.0) {
      end_of_step(*tables_, acting_, slope_, dw_);
      end_of_step(*tables_, acting_, value_, end_);
    } else {
      within_step(book_, nodes_, halves_, *now_.mode, step.step_class, step.fraction, acting_, slope_, dw_);
      within_step(book_, nodes_, halves_, *now_.mode, step.step_class, step.fraction, acting_, value_, end_);
    }
    for (const Shadow& one : shadows_) add_place(one, one.at(nodes_, halves_, step.length, step.fraction, acting_).place);
    now_.time = Jet(step.time + step.length * step.fraction);
    std::vector<double> values(sizes_.inputs(), 0.0);
    double slope, bend;
    for (int i : acting_) value_.at(nodes_, i, step.fraction, values[i], slope, bend);
    rate_of_state(*now_.mode, acting_, end_, values, value_.sources, rate_);
  }

  // ---- events

  bool same_instant(size_t event, size_t steps) const {
    return event < record_->count && record_->notes[event].steps == double(steps);
  }

  // All events that happened when so many steps had been recorded. Returns the number of the next event.
  size_t happen(size_t event, size_t steps) {
    event_ = event;
    first_foot_ = -1;
    struck_.clear();
    for (; same_instant(event, steps); event++) {
      if (record_->notes[event].origin == MARKED) {
        note_mark(event);
        continue;
      }
      if (!moving_) begin_instant(event, steps);
      apply(event);
    }
    return event_ = event;
  }

  void note_mark(size_t event) {
    const Event& e = record_->events[event];
    FootTangent& foot = feet_[int(e.foot)];
    Row* to = &out_->events[event * EVENT_WIDTH];
    // one that is no end of a period is that of the run
    const double turns = std::isfinite(settings_.period) ? std::round(e.time / settings_.period) : 0.0;
    const bool whole = std::fabs(e.time - turns * settings_.period) <= 1e-12 * e.time && e.time < settings_.end;
    to[0] = whole ? data_.period * turns : Row(0.0);
    to[9] = foot.apex;
    to[10] = foot.apex_time;
    to[11] = foot.integral;
    foot.apex = Row(0.0);
    foot.apex_time = to[0];
  }

  // The first event of an instant: how its moment moves, and the state with it.
  void begin_instant(size_t event, size_t steps) {
    int foot = int(record_->events[event].foot);
    // an impact may have torn this foot off first: then it is the impact's moment
    if (record_->events[event].kind == RELEASE && same_instant(event + 1, steps)) {
      const Event& next = record_->events[event + 1];
      const int other = int(next.foot);
      const bool lands = next.kind != RELEASE && next.kind != CONTACT_AT_START && other != foot;
      if (lands && !now_.mode->is_held[other] && at_ground(other)) foot = other;
    }
    first_foot_ = foot;
    if (!(step_.fraction == 0.0 && shared_at_ >= now_.time.value - settings_.least_progress)) {
      const Shown<Row> shown = shown_at(step_, step_.fraction);
      const Margin found = now_.mode->is_held[foot] ? hold_margin(foot, shown) : gap_margin(foot, shown);
      shared_ = -found.by / found.rate;
      shared_at_ = now_.time.value;
      if (found.grazes) flag(event, GRAZING, -1);
    }
    now_.time = jet(now_.time.value, shared_);
    now_.w.clear();
    for (int k = 0; k < sizes_.state(); k++) now_.w.push_back(jet(end_[k], dw_[k] + shared_ * rate_[k]));
    note_drives();
    if (!out_->steps.empty()) out_->steps[out_->steps.size() - kept_width()] = shared_;
    moving_ = true;
    if (shadows_.empty()) return;
    const std::vector<Jet> place = now_.place();
    std::vector<Row> more(sizes_.state(), Row(0.0));
    for (Shadow& one : shadows_) {
      one.begin_instant(now_, place);
      add_momenta(one, 1.0, more);
    }
    for (int k = 0; k < sizes_.state(); k++) now_.w[k] = jet(now_.w[k].value, slope_of(now_.w[k]) + more[k]);
  }

  // An event function: its tangents at a fixed time, and its rate.
  struct Margin {
    Row by;
    double rate;
    bool grazes;
  };

  bool at_ground(int i) const {
    double gap = dot(now_.mode->outputs + size_t(i) * sizes_.state(), end_) + now_.biased(now_.mode->bias_feed, 2 * sizes_.feet, i).value;
    return std::fabs(gap) <= 10.0 * (settings_.gap_zero + settings_.gap);
  }

  // The gap of a free foot. It grazes where it would dip below the ground by no more than some errors of a gap.
  Margin gap_margin(int i, const Shown<Row>& shown) const {
    const double rate = dot(now_.mode->outputs + size_t(i) * sizes_.state(), rate_);
    const double curve = bend_of(i, step_.fraction) / (step_.length * step_.length);
    return {shown.gap[i], rate, curve > 0.0 && 0.5 * rate * rate < GRAZE * settings_.gap * curve};
  }
  static constexpr double GRAZE = 100.0;

  // What still holds a held foot: strength less smooth force less pull.
  Margin hold_margin(int i, const Shown<Row>& shown) {
    const int ni = sizes_.inputs();
    double pulling = dot(now_.mode->outputs + size_t(i) * sizes_.state(), rate_);
    for (int k : acting_) {
      double v, v1, v2;
      value_.at(nodes_, k, step_.fraction, v, v1, v2);
      pulling += (v1 * now_.mode->feed[i * ni + k] + v2 * now_.mode->feed_rate[i * ni + k] / step_.length) / step_.length;
    }
    const int c = channel_of(i);
    const Jet at(now_.time.value), later = jet(at.value, Row(1.0)), volts = drive_at(c, at);
    const Row by = slope_of(holds(i, at - now_.since[i], volts, at)) - shown.pull[i];
    const Jet age(at.value - now_.since[i].value), still(volts.value);
    const Jet rising = jet(volts.value, slope_of(drive_at(c, later)) - slope_of(volts));
    const Row holding = slope_of(holds(i, jet(age.value, Row(1.0)), rising, later)) - slope_of(holds(i, age, still, at));
    const double rate = holding[0] - pulling;
    return {by, rate, std::fabs(rate) <= 1e-9 * run_.scales[1] / settings_.end};
  }

  // Pull that breaks the contact of a held foot off.
  Jet holds(int i, const Jet& age, const Jet& volts, const Jet& time) {
    Jet out(0.0);
    if (laws_.has(i, HAS_LATCH)) out = laws_.value(STRENGTH, i, {age});
    if (laws_.has(i, HAS_FORCE)) out = out - laws_.force(i, Jet(0.0), Jet(0.0), volts, time);
    return out;
  }

  // An event by the run and by its shadows. An impact that is the second of two at one moment has a moment of its own where
  // the two need not stay together and do not touch each other; where they do, there is no derivative.
  void apply(size_t event) {
    const Event& e = record_->events[event];
    const int foot = int(e.foot);
    const EventKind kind = EventKind(int(e.kind));
    const bool lands = kind == BOUNCE || kind == CAPTURE || kind == REST;
    const Row off = lands && foot != first_foot_ ? coincidence(foot) : Row(0.0);
    Row apart = Row(0.0);
    if (any_less(Row(0.0), magnitude(off))) {
      bool independent = true;
      for (int other : struck_) independent = independent && now_.independent(foot, other);
      if (independent) {
        apart = -off / now_.rate_at_ground(foot);
        flag(event, APART, -1);
        now_.shift_moment(apart);
      }
      for (int lane = 0; lane < LANES && !independent; lane++) {
        if (off[lane] != 0.0) flag(event, SIMULTANEOUS, lane);
      }
    }
    EventNumbers found = now_.apply(kind, foot, e.strength != 0.0);
    for (Shadow& one : shadows_) add_numbers(one, one.instant.apply(kind, foot, e.strength != 0.0), found);
    put(event, found);
    if (found.doubtful) flag(event, AT_THRESHOLD, -1);
    if (any_less(Row(0.0), magnitude(apart))) now_.shift_moment(-apart);
    if (lands) struck_.push_back(foot);
  }

  static void add_numbers(const Shadow& one, const EventNumbers& own, EventNumbers& to) {
    const auto add = [&](const Jet& from, Jet& into) { into.slope[one.lane] += one.weight * from.value; };
    add(own.when, to.when);
    add(own.before, to.before);
    add(own.after, to.after);
    add(own.pull, to.pull);
    add(own.strength, to.strength);
    add(own.energy, to.energy);
    add(own.adhesion, to.adhesion);
  }

  void put(size_t event, const EventNumbers& numbers) {
    Row* to = &out_->events[event * EVENT_WIDTH];
    FootTangent& foot = feet_[int(record_->events[event].foot)];
    to[0] = slope_of(numbers.when);
    int n = 3;
    for (const Jet* one : {&numbers.before, &numbers.after, &numbers.pull, &numbers.strength, &numbers.energy, &numbers.adhesion}) {
      to[n++] = slope_of(*one);
    }
    to[9] = foot.apex;
    to[10] = foot.apex_time;
    to[11] = foot.integral;
    foot.apex = Row(0.0);
    foot.apex_time = slope_of(now_.time);
  }

  // How the gap of a foot that lands moves at an instant, where it does: beyond rounding of its terms.
  Row coincidence(int foot) const {
    const double* row = now_.mode->outputs + size_t(foot) * sizes_.state();
    Row found = slope_of(now_.gap_of(foot)), size = magnitude(slope_of(now_.biased(now_.mode->bias_feed, 2 * sizes_.feet, foot)));
    for (const Shadow& one : shadows_) one.add(one.instant.gap_of(foot).value, found);
    for (int k = 0; k < sizes_.state(); k++) size += magnitude(slope_of(now_.w[k])) * std::fabs(row[k]);
    Row out = Row(0.0);
    for (int lane = 0; lane < LANES; lane++) {
      if (std::fabs(found[lane]) > 1e-6 * size[lane]) out.set(lane, found[lane]);
    }
    return out;
  }

  // Edges of drives that lie at the very start and move: on one side they have an effect there.
  void flag_edges() {
    const Signals& s = drives_.signals;
    for (size_t c = 0; c < channels_; c++) {
      const Cursor& at = drives_.player.cursor[c];
      const Jet edge = drives_.beginning(int(c), at);
      if (std::fabs(edge.value - now_.time.value) > 1e-12 * (s.end[at.piece] - s.start[at.piece]) + 1e-14 * now_.time.value) continue;
      const bool first = at.piece == at.first + std::max<int64_t>(at.loop, 0);
      if (first && at.loop < 0) continue;
      double jump = 0.0;  // from the end of the piece before to the start of this one
      for (int k = 0; k < DEGREE; k++) {
        jump += s.coef[DEGREE * (first ? at.behind - 1 : at.piece - 1) + k] - (k % 2 ? -1.0 : 1.0) * s.coef[DEGREE * at.piece + k];
      }
      if (std::fabs(jump) <= 1e-9 * s.span[run_.channels[c]]) continue;
      for (int lane = 0; lane < LANES; lane++) {
        if (edge.slope[lane] != 0.0) flag(0, EDGE_AT_START, lane);
      }
    }
  }

  void flag(size_t event, Doubtful reason, int lane) { out_->flags.push_back({double(event), double(reason), double(lane)}); }
  void lose(size_t event) {
    flag(event, LOST, -1);
    for (Row& one : dw_) one = Row(NOT_A_NUMBER);
  }
};

}  // namespace tarsus::modal
