// Derivatives of the steps of a recorded run: what enters one, its linearisation, and what it leads to.
#pragma once
#include "tangent_shadow.hpp"
#include "window.hpp"

namespace tarsus::modal {

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

// A run of which steps are gone through again, one after the other.
class StepTangents {
 public:
  // ``beside``: structures for the lanes whose numbers are the structure's own.
  StepTangents(Book& book, const Nodes& nodes, const Halves& halves, const Signals& signals, const Laws& laws,
               const Settings& settings, const RunData& run, const Beginning& start, const DataTangents& data, size_t channels,
               const std::vector<Beside>& beside)
      : book_(book), sizes_(book.sizes), nodes_(nodes), halves_(halves), settings_(settings.of(run)), run_(run), data_(data),
        laws_(laws, run.parameters, data.parameters),
        fixed_laws_(laws, run.parameters, std::vector<Row>(data.parameters.size(), Row(0.0))), drives_(signals, nodes, data, run, channels),
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

 protected:
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
  LawTangents laws_, fixed_laws_;  // with the parameters' derivatives, and without
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
    const Shown<Row> shown = shown_at(step, s);
    feet_[i].apex = shown.gap[i];
    const double bend = bend_of(i, s);
    // one at the beginning or the end of a flight stays there
    const bool inside = s > 0.0 && s < step.fraction && bend < 0.0;
    feet_[i].apex_time = inside ? shown.rate[i] * (-step.length * step.length / bend) : Row(0.0);
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

  void flag(size_t event, Doubtful reason, int lane) { out_->flags.push_back({double(event), double(reason), double(lane)}); }
  void lose(size_t event) {
    flag(event, LOST, -1);
    for (Row& one : dw_) one = Row(NOT_A_NUMBER);
  }
};

}  // namespace tarsus::modal
