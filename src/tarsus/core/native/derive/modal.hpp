// Derivatives of a recorded run of a modal robot: a march over its own steps and events (see docs/gradients.md).
//
// Between events the state's tangents at fixed times are those of the collocated solution; how moments move, and what is
// reported, is in derive/shell.hpp.
#pragma once
#include "derive/instant.hpp"
#include "derive/modal_power.hpp"
#include "derive/run.hpp"

namespace tarsus::modal {

class ModalTangent {
 public:
  // ``structural``: the lanes whose numbers are the structure's own.
  ModalTangent(Book& book, const Nodes& nodes, const Signals& signals, const Laws& laws,
               const Settings& settings, const RunData& run, const Beginning& start, const DataTangents& data, size_t channels,
               const std::vector<Structural>& structural)
      : book_(book), sizes_(book.sizes), nodes_(nodes), settings_(start.ended(settings).of(run, book.sizes.feet)),
        run_(run), data_(data),
        laws_(laws, run.parameters, data.parameters),
        fixed_laws_(laws, run.parameters, std::vector<Row>(data.parameters.size(), Row(0.0))), drives_(signals, nodes, data, run, channels),
        structural_(structural), now_(book, laws_, settings_, sources_of(run, data, book.sizes), structural_),
        reported_(settings_, sizes_.feet, run.scales[1], data.period), dw_(sizes_.state(), Row(0.0)),
        gaps_(sizes_.feet, Row(0.0)), channel_values_(channels * N), channel_slopes_(channels * N), channels_(channels), value_(sizes_), slope_(sizes_),
        value_room_(sizes_), slope_room_(sizes_), inside_structure_(sizes_), by_structure_(sizes_), shown_(sizes_), last_(sizes_) {
    value_.sources.assign(run.sources, run.sources + sizes_.sources());
    slope_.sources = data.sources;
    FootSet on(sizes_.constraints());
    for (int r = 0; r < 2 * sizes_.coordinates; r++) now_.physical[r] = jet(run.initial[r], data.initial[r]);
    for (int i = 0; i < sizes_.feet; i++) {
      const double since = start.begun(i);
      now_.since[i] = jet(since, data.since[i] + (since == start.time ? data.start : Row(0.0)));
      now_.parted[i] = start.feet != nullptr ? Jet(start.feet[i].parted) : jet(start.time, data.start);
      if (start.feet != nullptr) now_.aged[i] = Jet(start.feet[i].aged);
      now_.frictional[i] = book.has_way(i) && has_friction(laws_.plain(), i);
      if (!start.holds(i)) continue;
      on.toggle(i);
      if (now_.frictional[i]) begin_along(i, on);
    }
    for (size_t c = 0; c < channels; c++) drives_.player.seek(int(c), start.time);
    now_.time = jet(start.time, data.start);
    note_drives();
    now_.enter(book.require(on));
    moving_ = true;
  }

  // powers: to be integrated, or null.
  TangentResult run(const RunRecord& record, const double* times, size_t count, PowerSlopes* powers) {
    reported_.events.assign(record.count * EVENT_WIDTH, Row(0.0));
    samples_.assign(count * tangent_width(sizes_), Row(0.0));
    record_ = &record;
    powers_ = powers;
    size_t sample = 0;
    drives_.edges_at(now_.time.value, [&](int lane) { reported_.flag(0, EDGE_AT_START, lane); });
    size_t event = apply_events(0, 0);
    Recording steps(book_, record.trace);
    for (size_t r = 0; r < record.rows; r++) {
      const Recorded step = steps.step(r);
      if (step.mode != now_.mode) {
        lose(event);
        break;
      }
      begin_step(step);
      linearise(step);
      const bool last = r + 1 == record.rows;
      while (sample < count && (last || times[sample] < steps.row(r + 1)[0])) {
        take_sample(step, std::min(std::max((times[sample] - step.time) / step.length, 0.0), step.fraction), sample);
        sample++;
      }
      track(step, event);
      if (powers != nullptr) track_powers(step);
      end_step(step);
      event = apply_events(event, r + 1);
    }
    if (powers != nullptr && moved_end_) powers->add_moving(last_, end_moves_);
    return {std::move(reported_.events), std::move(samples_), std::move(reported_.flags)};
  }

  // One smooth input: its slopes at the nodes, and its own tangents at fixed gaps and rates.
  struct Smooth {
    int input, foot, channel;  // of its voltage, or -1
    bool rated, given;         // whether it depends on the rate; whether it has tangents of its own
    Row by_gap, by_rate, arguments[4], own[N];  // arguments: gaps, rates, voltages and times at the nodes

    Hook hook(int feet) const { return input < feet ? MOMENTUM : FORCE; }
    int count(int feet) const { return input < feet ? 1 : 4; }  // of its laws' arguments
    // Whether it depends on an output, a gap or a rate, and how.
    bool feels(int output, int feet) const { return output % feet == foot && (output < feet || rated); }
    const Row& by(int output, int feet) const { return output < feet ? by_gap : by_rate; }
  };

  Book& book_;
  const Sizes sizes_;
  const Nodes& nodes_;
  const Settings settings_;
  const RunData run_;
  const DataTangents& data_;
  LawTangents laws_, fixed_laws_;  // with the parameters' derivatives, and without
  DriveTangents drives_;
  const std::vector<Structural> structural_;
  Instant now_;
  EventShell reported_;
  bool moving_ = false;   // within an instant
  std::vector<Row> dw_;   // tangents of the flowing state at the present, fixed time
  std::vector<Row> gaps_;               // of the free feet at the nodes of the step
  std::vector<double> channel_values_;  // (channels, 8) there
  std::vector<Row> channel_slopes_;
  size_t channels_;
  Entering<double> value_;  // what enters the step, and its tangents
  Entering<Row> slope_;
  mutable Inside<double> value_room_;
  mutable Inside<Row> slope_room_;
  mutable InsideByStructure inside_structure_;
  mutable Shown<double> by_structure_;
  mutable Shown<Row> shown_;  // see shown_at
  mutable std::vector<Row> inside_;
  std::vector<double> flown_;  // the state somewhere within the step
  std::vector<int> acting_, smooth_;  // inputs that act; of these the smooth ones of feet in the air
  std::vector<int> braked_;          // feet that slide with friction
  std::vector<double> friction_end_;  // on each foot, as the last step ended [N]
  const ContactMode* acting_in_ = nullptr;
  bool ended_ = true;           // whether ``end_`` and ``rate_`` are those of the step
  std::vector<double> moved_;   // what the state at the end of the step has of a number of the structure
  std::vector<Row> flowed_;     // tangents of the state at the end of the step
  std::vector<Smooth> solved_;  // see solve_smooth
  std::vector<int> unknown_;    // outputs that smooth inputs depend on, of feet these act on
  std::vector<Row> right_;      // (unknown, 8)
  Factored solver_;
  std::vector<size_t> next_;  // of each foot, its next event
  std::vector<Row> gap_slopes_;  // (feet, 8)
  std::vector<double> end_, rate_;  // the flowing state at the end of the step, and its rate there
  const StepClass* tables_ = nullptr;
  Recorded step_ = {};
  std::vector<int> landed_;  // feet that have landed in this instant
  int first_foot_ = -1;      // whose event this instant is
  size_t event_ = 0;         // the next one
  const RunRecord* record_ = nullptr;
  std::vector<Row> samples_;  // as in TangentResult
  PowerSlopes* powers_ = nullptr;
  Shown<double> last_;             // at the end of the last step, where powers are asked for;
  bool moved_end_ = false;         // whether that moves, and how
  Row end_moves_ = Row(0.0);

  static std::vector<Jet> sources_of(const RunData& run, const DataTangents& data, const Sizes& sizes) {
    std::vector<Jet> out;
    for (int q = 0; q < sizes.sources(); q++) out.push_back(jet(run.sources[q], data.sources[q]));
    return out;
  }
  int channel_of(int foot) const { return int(laws_.laws.volts[foot]); }
  Jet drive_at(int c, const Jet& time) const { return c < 0 ? Jet(0.0) : drives_.value(c, drives_.player.cursor[c], time); }
  // A held foot of a window slides as it is moving along the ground, or sticks: as the run has it.
  void begin_along(int i, FootSet& on) {
    const double rate = book_.place_along(i, std::vector<double>(run_.initial + sizes_.coordinates, run_.initial + 2 * sizes_.coordinates));
    now_.senses[i] = std::fabs(rate) <= settings_.speed_zero ? 0.0 : rate > 0.0 ? 1.0 : -1.0;
    if (now_.senses[i] == 0.0) on.toggle(sizes_.feet + i);
  }
  void note_drives() {
    now_.drives.clear();
    for (size_t c = 0; c < channels_; c++) now_.drives.push_back(drive_at(int(c), now_.time));
  }

  // ---- a step

  // A step of the run itself: what enters it.
  void take_step(const Recorded& step) {
    const ContactMode& mode = *step.mode;
    const int ns = sizes_.stride, nb = mode.blocks_used;
    step_ = step;
    ended_ = false;
    if (acting_in_ != &mode) {
      acting_in_ = &mode;
      acting_ = acting_inputs(mode, laws_.plain());
      smooth_.clear();
      for (int i : acting_) {
        if (i < 2 * sizes_.feet && !mode.is_held[i % sizes_.feet]) smooth_.push_back(i);
      }
      braked_.clear();
      for (int i : mode.sliding) {
        if (now_.frictional[i]) braked_.push_back(i);
      }
      list_unknown(mode);
      std::fill(slope_.inputs.begin(), slope_.inputs.end(), Row(0.0));
    }
    std::fill(value_.state.begin(), value_.state.end(), 0.0);
    std::copy(step.state, step.state + nb, value_.state.begin());
    std::copy(step.state + nb, step.state + 2 * nb, value_.state.begin() + ns);
    std::copy(step.inputs, step.inputs + value_.inputs.size(), value_.inputs.begin());
    for (int i : braked_) {  // at the start, where the foot is held still
      const double force = value_.input(sizes_.feet + i)[0];
      if (force != 0.0) now_.senses[i] = force < 0.0 ? 1.0 : -1.0;
    }
  }

  // Inputs and state at the start of a step; an instant ends, and kinks whose time moves pass.
  void begin_step(const Recorded& step) {
    take_step(step);
    const ContactMode& mode = *now_.mode;
    const std::vector<Cursor> left = drives_.player.cursor;
    for (size_t c = 0; c < channels_; c++) {
      drives_.fill(int(c), step.time, step.length, &channel_values_[N * c], &channel_slopes_[N * c]);
    }
    if (moving_) {
      end_instant();
    } else {
      pass_kinks(left);
    }
  }

  void end_instant() {
    const ContactMode& mode = *now_.mode;
    std::vector<double> values(sizes_.inputs(), 0.0), rate;
    for (int i : acting_) values[i] = value_.input(i)[0];
    rate_of_state(mode, acting_, value_.state, values, value_.sources, rate);
    for (int k = 0; k < sizes_.state(); k++) dw_[k] = slope_of(now_.w[k]) - slope_of(now_.time) * rate[k];
    moving_ = false;
  }

  // A channel that has jumped where its kink's time moves shifts the state by the difference of its rates.
  void pass_kinks(const std::vector<Cursor>& left) {
    for (size_t c = 0; c < channels_; c++) {
      const Cursor &was = left[c], &now = drives_.player.cursor[c];
      if (!drives_.passed(was, now, step_.time)) continue;
      if (!reported_.take_kink(event_, slope_of(drives_.beginning(int(c), now)), step_.time)) continue;
      move_end();
      each_jump(int(c), drives_.value(int(c), was, Jet(step_.time)).value, channel_values_[N * c], [&](int k, double by) {
        dw_[k] += reported_.shared * by;
      });
    }
  }

  // How the state moves with the time of a kink at the start of the step, at which a channel jumps: to(component, rate).
  template <class To>
  void each_jump(int c, double before, double after, To&& to) {
    const int m = sizes_.feet;
    const ContactMode& mode = *step_.mode;
    const auto push = [&](int input, double by) {
      const double* row = mode.inputs + size_t(input) * sizes_.state();
      for (int k = 0; k < sizes_.state(); k++) to(k, row[k] * by);
    };
    if (c < sizes_.drives) push(2 * m + c, before - after);
    // friction jumps with the pulls that drives make
    for (int i : braked_) push(m + i, friction_end_[i] - value_.input(m + i)[0]);
    for (int i : mode.free) {
      if (!laws_.has(i, HAS_FORCE) || channel_of(i) != c) continue;
      Shown<double> shown(sizes_);
      show(mode, nodes_, step_.length, 0.0, acting_, value_, value_.state, shown);
      const Jet gap(shown.gap[i]), rate(shown.rate[i]), time(step_.time);
      push(m + i, laws_.force(i, gap, rate, Jet(before), time).value - laws_.force(i, gap, rate, Jet(after), time).value);
    }
  }

  void list_unknown(const ContactMode& mode) {
    const int m = sizes_.feet;
    unknown_.clear();
    for (int i : mode.free) {
      if (laws_.has(i, HAS_MOMENTUM) || laws_.has(i, HAS_FORCE)) unknown_.push_back(i);
      if (laws_.has(i, HAS_FORCE) && laws_.has(i, USES_RATE)) unknown_.push_back(m + i);
    }
    for (int i : braked_) {  // the pull that bears friction, and the speed of the slide
      unknown_.push_back(i);
      if (laws_.laws.friction_by_speed) unknown_.push_back(m + i);
    }
  }

  // Tangents of the nodal inputs: the drives' own, and the smooth forces'. What these depend on, gaps and rates y, follow from
  // (1 - G S) dy = dlinear + G own, with S the forces' slopes by y, and G what they do to y.
  void linearise(const Recorded& step) {
    find_tables();
    const int m = sizes_.feet;
    slope_.state = dw_;
    for (int d = 0; d < sizes_.drives; d++) std::copy_n(&channel_slopes_[N * d], N, slope_.input(2 * m + d));
    for (int i : smooth_) std::fill_n(slope_.input(i), N, Row(0.0));
    for (int i : braked_) std::fill_n(slope_.input(m + i), N, Row(0.0));
    for (int i : now_.mode->stuck) std::fill_n(slope_.input(m + i), N, slope_of(now_.places[i]));
    gap_slopes_.assign(size_t(m) * N, Row(0.0));
    for (int i : now_.mode->free) output_slopes(i, &gap_slopes_[N * i]);
    if (!smooth_.empty() || !braked_.empty()) solve_smooth(step);
  }

  // The tables of the step, and the gaps of the free feet at its nodes.
  void find_tables() {
    tables_ = &book_.step(*step_.mode, step_.step_class);
    for (int i : step_.mode->free) gaps_[i] = output_row(*tables_, acting_, value_, i);
  }

  void output_slopes(int output, Row* to) const {
    outputs_at_nodes(*tables_, acting_, slope_, output, to);
    for (const Structural& one : structural_) {
      double line[N];
      outputs_at_nodes(one.book->step(*now_.mode, step_.step_class).tables, acting_, value_, output, line);
      for (int j = 0; j < N; j++) one.add(line[j], to[j]);
    }
  }

  void solve_smooth(const Recorded& step) {
    const int m = sizes_.feet, size = int(unknown_.size()) * N;
    solved_.clear();
    for (int i : smooth_) {
      solved_.push_back(smooth_input(step, i));
      add_own(solved_.back());
    }
    for (int i : braked_) solved_.push_back(friction_input(step, i));
    right_.resize(size);
    for (size_t a = 0; a < unknown_.size(); a++) {
      const int output = unknown_[a];
      if (output < m && !now_.mode->is_held[output]) {
        std::copy_n(&gap_slopes_[N * output], N, &right_[N * a]);
      } else {
        output_slopes(output, &right_[N * a]);
      }
      for (const Smooth& one : solved_) {
        if (one.given) add_input(*tables_, output, one.input, one.own, &right_[N * a]);
      }
    }
    if (!factor_forces()) return lose(event_);
    solver_.solve_transposed(right_.data());
    for (size_t a = 0; a < unknown_.size(); a++) {
      const int foot = unknown_[a] % m;
      const Row* found = &right_[N * a];
      if (unknown_[a] < m && !now_.mode->is_held[foot]) std::copy_n(found, N, &gap_slopes_[N * foot]);
      for (Smooth& one : solved_) {
        if (!one.feels(unknown_[a], m)) continue;
        for (int j = 0; j < N; j++) one.own[j] += found[j] * one.by(unknown_[a], m)[j];
      }
    }
    for (const Smooth& one : solved_) std::copy_n(one.own, N, slope_.input(one.input));
    for (int o : now_.mode->free) {
      if (laws_.has(o, HAS_MOMENTUM) || laws_.has(o, HAS_FORCE)) continue;
      for (const Smooth& one : solved_) add_input(*tables_, o, one.input, slope_.input(one.input), &gap_slopes_[N * o]);
    }
  }

  // 1 - G S, transposed: one row is what a node of an unknown does to all. False where it is singular.
  bool factor_forces() {
    const int m = sizes_.feet, size = int(unknown_.size()) * N;
    solver_.begin(size);
    for (int r = 0; r < size; r++) solver_.row(r)[r] = 1.0;
    for (size_t a = 0; a < unknown_.size(); a++) {
      for (const Smooth& one : solved_) {
        const double* effect = tables_->from_input(unknown_[a], one.input);
        for (size_t b = 0; b < unknown_.size(); b++) {
          if (!one.feels(unknown_[b], m)) continue;
          const Row& by = one.by(unknown_[b], m);
          for (int l = 0; l < N; l++) {
            double* to = solver_.row(int(b) * N + l) + a * N;
            store(to, load(to) - load(effect + l * N) * by[l]);
          }
        }
      }
    }
    return solver_.eliminate();
  }

  Smooth smooth_input(const Recorded& step, int i) {
    const int m = sizes_.feet, foot = i % m;
    const bool force = i >= m;
    Smooth out = {i, foot, force ? channel_of(foot) : -1, force && laws_.has(foot, USES_RATE), false, Row(0.0), Row(0.0), {}, {}};
    out.arguments[0] = gaps_[foot];
    out.arguments[1] = out.rated ? output_row(*tables_, acting_, value_, m + foot) : Row(0.0);
    out.arguments[2] = out.channel < 0 ? Row(0.0) : load(&channel_values_[N * out.channel]);
    out.arguments[3] = nodes_.times() * step.length + step.time;
    laws_.slopes(out.hook(m), foot, out.arguments, out.count(m), out.by_gap, out.by_rate);
    std::fill_n(out.own, N, Row(0.0));
    return out;
  }

  // Friction on a foot that slides, -sense bound(margin, f_a, speed): what it depends on are the pull and the rate along the ground.
  Smooth friction_input(const Recorded& step, int i) {
    const int m = sizes_.feet, c = channel_of(i);
    const double sense = now_.senses[i];
    Smooth out = {m + i, i, -1, laws_.laws.friction_by_speed, true, Row(0.0), Row(0.0), {}, {}};
    const Row times = nodes_.times() * step.length + step.time, ages = times - now_.since[i].value;
    const Row volts = c < 0 ? Row(0.0) : load(&channel_values_[N * c]);
    const Row strength = laws_.plain().strength(i, ages, volts);
    Row margin = strength - output_row(*tables_, acting_, value_, i);
    if (laws_.has(i, HAS_FORCE)) margin -= laws_.plain().force(i, Row(0.0), Row(0.0), volts, times);
    const Row speed = output_row(*tables_, acting_, value_, m + i) * sense;
    const SlidingTangent found = sliding_tangent(laws_, i, margin, strength, speed, now_.begins[i]);
    out.by_gap = found.by[MARGIN] * sense;
    out.by_rate = -found.by[SLIP_SPEED];
    for (int j = 0; j < N; j++) {
      const Jet time(times[j]), at = c < 0 ? Jet(0.0) : jet(volts[j], channel_slopes_[N * c + j]);
      const Jet held = laws_.strength(i, time - now_.since[i], at);
      Jet breaking = held;
      if (laws_.has(i, HAS_FORCE)) breaking = breaking - laws_.force(i, Jet(0.0), Jet(0.0), at, time);
      for (int lane = 0; lane < LANES; lane++) out.own[j].set(lane, found.own[lane][j]);
      out.own[j] = (out.own[j] + slope_of(breaking) * found.by[MARGIN][j] + slope_of(held) * found.by[HELD_STRENGTH][j]) * -sense;
    }
    return out;
  }

  // What it has by the parameters of its laws and by its voltage.
  void add_own(Smooth& one) {
    const int m = sizes_.feet, c = one.channel;
    one.given = laws_.varied[one.foot] || c >= 0;
    if (!one.given) return;
    laws_.add_explicit(one.hook(m), one.foot, one.arguments, one.count(m), c < 0 ? nullptr : &channel_slopes_[N * c], one.own);
  }

  // The moment at which the last step has ended moves.
  void move_end() {
    end_moves_ = reported_.shared;
    moved_end_ = any_less(Row(0.0), magnitude(end_moves_));
  }

  // What the powers over a step add to the energies.
  void track_powers(const Recorded& step) {
    const auto values = [&](double s) -> const Shown<double>& {
      within_step(book_, nodes_, *step.mode, step.step_class, s, acting_, value_, value_room_, flown_);
      show(*step.mode, nodes_, step.length, s, acting_, value_, flown_, by_structure_);
      return by_structure_;
    };
    if (moved_end_) {
      powers_->add_moving(last_, end_moves_);
      powers_->add_moving(values(0.0), -end_moves_);
      moved_end_ = false;
    }
    powers_->add_step(step.length, step.fraction, step.mode->rate, [&](double s) {
      const Shown<Row>& tangents = shown_at(step, s);
      return std::pair<const Shown<double>*, const Shown<Row>*>(&values(s), &tangents);
    });
    last_ = values(step.fraction);
  }

  // Tangents of what is shown at scaled time s of the step, until the next are asked for.
  const Shown<Row>& shown_at(const Recorded& step, double s) const {
    within_step(book_, nodes_, *now_.mode, step.step_class, s, acting_, slope_, slope_room_, inside_);
    for (const Structural& one : structural_) {
      find_inside(one, step, s);
      for (size_t k = 0; k < inside_.size(); k++) one.add(inside_structure_.moved[k], inside_[k]);
    }
    return shown_with(step, s, inside_, inside_structure_.state);
  }
  const Shown<Row>& shown_at_end() const { return shown_with(step_, step_.fraction, flowed_, end_); }
  void find_inside(const Structural& one, const Recorded& step, double s) const {
    inside_structure_.find(*one.book, nodes_, *now_.mode, step.step_class, s, acting_, value_);
  }

  const Shown<Row>& shown_with(const Recorded& step, double s, const std::vector<Row>& state, const std::vector<double>& value) const {
    Shown<Row>& out = shown_;
    show(*now_.mode, nodes_, step.length, s, acting_, slope_, state, out);
    for (const Structural& one : structural_) {
      Shown<double>& own = by_structure_;
      show_by_structure(*now_.mode, *one.book->mode(*now_.mode).rows, nodes_, step.length, s, acting_, value_, value, own);
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
    const Shown<Row>& shown = shown_at(step, s);
    Row* to = samples_.data() + n * tangent_width(sizes_);
    to = std::copy(shown.place.begin(), shown.place.end(), to);
    for (const auto* part : {&shown.gap, &shown.rate, &shown.resistive, &shown.smooth, &shown.pull}) {
      to = std::copy(part->begin(), part->end(), to);
    }
  }

  // The highest gap of the flights that end next, and integrals of the gaps: what of them lies in this step.
  void track(const Recorded& step, size_t event) {
    Row weights = Row(0.0);  // of the integral up to the end of the step
    double power = step.fraction * step.length;
    for (int c = 0; c < N; c++, power *= step.fraction) weights += load(nodes_.monomial[c]) * (power / (c + 1));
    next_.resize(sizes_.feet, 0);
    for (int i : now_.mode->free) {
      if (nearly_lands(step, i)) reported_.flag(event, NEAR_MISS);
      reported_.feet[i].integral += weighted(weights, &gap_slopes_[N * i]);
      size_t& next = next_[i];
      next = std::max(next, event);
      while (next < record_->count && record_->events[next].foot != i) next++;
      if (next == record_->count || !(record_->events[next].apex > 0.0)) continue;
      const double s = (record_->events[next].apex_time - step.time) / step.length;
      if (s >= 0.0 && s <= step.fraction) note_apex(step, i, s);
    }
  }

  bool nearly_lands(const Recorded& step, int i) {
    return reported_.nearly_lands(nodes_, gaps_[i], step.fraction, [&](double s) {
      within_step(book_, nodes_, *step.mode, step.step_class, s, acting_, value_, value_room_, flown_);
      show(*step.mode, nodes_, step.length, s, acting_, value_, flown_, by_structure_);
      return std::pair<double, double>(by_structure_.gap[i], by_structure_.rate[i] * step.length);
    });
  }

  void note_apex(const Recorded& step, int i, double s) {
    const Shown<Row>& shown = shown_at(step, s);
    reported_.feet[i].apex = shown.gap[i];
    const double bend = bend_of(i, s);
    // one at the beginning or the end of a flight stays there
    const bool inside = s > 0.0 && s < step.fraction && bend < 0.0;
    reported_.feet[i].apex_time = inside ? shown.rate[i] * (-step.length * step.length / bend) : Row(0.0);
  }

  // Second derivative of a gap by the scaled time.
  double bend_of(int i, double s) const {
    return total(Weights(nodes_, s).bend * gaps_[i]);
  }

  // Tangents of the state at the end of a step.
  void end_step(const Recorded& step) {
    if (step.fraction == 1.0) {
      end_of_step(*tables_, acting_, slope_, flowed_);
    } else {
      within_step(book_, nodes_, *now_.mode, step.step_class, step.fraction, acting_, slope_, slope_room_, flowed_);
    }
    for (const Structural& one : structural_) {
      if (step.fraction == 1.0) {
        end_by_structure(one.book->step(*now_.mode, step.step_class), acting_, value_, moved_);
      } else {
        find_inside(one, step, step.fraction);
        moved_ = inside_structure_.moved;
      }
      for (int k = 0; k < sizes_.state(); k++) one.add(moved_[k], flowed_[k]);
    }
    dw_ = flowed_;
    now_.time = Jet(step.time + step.length * step.fraction);
    if (step.fraction > 0.0) std::fill(now_.begins.begin(), now_.begins.end(), 0);
    friction_end_.assign(sizes_.feet, 0.0);
    for (int i : braked_) friction_end_[i] = weighted(Weights(nodes_, step.fraction).value, value_.input(sizes_.feet + i));
  }

  // And, where a foot has an event there, the state itself and its rate, with the inputs just before it.
  void end_values() {
    if (ended_) return;
    ended_ = true;
    if (step_.fraction == 1.0) {
      end_of_step(*tables_, acting_, value_, end_);
    } else {
      within_step(book_, nodes_, *now_.mode, step_.step_class, step_.fraction, acting_, value_, value_room_, end_);
    }
    std::vector<double> values(sizes_.inputs(), 0.0);
    const Weights weights(nodes_, step_.fraction);
    for (int i : acting_) values[i] = weighted(weights.value, value_.input(i));
    rate_of_state(*now_.mode, acting_, end_, values, value_.sources, rate_);
  }

  void lose(size_t event) {
    reported_.flag(event, LOST);
    for (Row& one : dw_) one = Row(NOT_A_NUMBER);
  }

  // ---- events

  bool same_instant(size_t event, size_t steps) const {
    return event < record_->count && record_->notes[event].steps == double(steps);
  }

  // Apply all events that follow so many recorded steps. Returns the number of the next event.
  size_t apply_events(size_t event, size_t steps) {
    event_ = event;
    first_foot_ = -1;
    landed_.clear();
    if (same_instant(event, steps)) end_values();
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
    const double* row = now_.mode->outputs + size_t(e.foot) * sizes_.state();
    reported_.put_mark(event, int(e.foot), reported_.mark_at(e.time), plain_gap(int(e.foot)), dot(row, rate_), rises_at(e));
  }
  static bool rises_at(const Event& mark) { return mark.apex_time == mark.time && mark.apex > 0.0; }

  // The foot whose event begins an instant.
  int first_foot(size_t event, size_t steps) const {
    const int foot = int(record_->events[event].foot);
    // an impact may have detached this foot first, and others: then the moment is that of the impact
    size_t after = event;
    const auto detached = [](const Event& e) { return e.kind == RELEASE || (e.kind == SLIP_BEGINS && !has_numbers(e)); };
    while (same_instant(after, steps) && detached(record_->events[after])) after++;
    if (after > event && same_instant(after, steps)) {
      const Event& next = record_->events[after];
      const int other = int(next.foot);
      const bool lands = next.kind != RELEASE && next.kind != CONTACT_AT_START && other != foot;
      if (lands && !now_.mode->is_held[other] && at_ground(other)) return other;
    }
    return foot;
  }

  // Whether the log has the strength of the contact, or its friction: of a foot detached by an impact it has none.
  static bool has_numbers(const Event& e) { return e.strength != 0.0 || (e.kind != RELEASE && e.pull != 0.0); }

  // Whether an event is that of this foot, and of how it moves along the ground.
  bool moves_along(size_t event, int foot) const {
    const Event& e = record_->events[event];
    return int(e.foot) == foot && (e.kind == SLIP_BEGINS || e.kind == STICK_BEGINS);
  }

  // Whether the instant of a foot's event shares the moment of the last one, or of a kink: no kink makes a foot land.
  bool at_shared(size_t event, int foot) const {
    if (step_.fraction != 0.0 || reported_.shared_at < now_.time.value - settings_.least_progress) return false;
    return !reported_.by_kink || now_.mode->is_held[foot] || record_->events[event].kind == CONTACT_AT_START;
  }

  // How the moment of an event moves with the tangents, at a fixed time, of the gap or the pull that determines it.
  void take_moment(size_t event, int foot, const Row& shown) {
    const Margin found = moves_along(event, foot) ? along_margin(foot)
                         : now_.mode->is_held[foot] ? hold_margin(foot, shown) : gap_margin(foot, shown);
    reported_.take_moment(event, found, now_.time.value);
    // a foot that comes to rest inside a step does so without a speed, which would determine the moment
    if (!found.grazes && record_->events[event].kind == CONTACT_AT_START) reported_.flag(event, GRAZING);
  }

  // Take the state along with the moment.
  void move_with_moment() {
    now_.time = jet(now_.time.value, reported_.shared);
    now_.w.clear();
    for (int k = 0; k < sizes_.state(); k++) now_.w.push_back(jet(end_[k], dw_[k] + reported_.shared * rate_[k]));
    note_drives();
    moving_ = true;
  }

  // The first event of an instant: how its moment moves, and the state with it.
  void begin_instant(size_t event, size_t steps) {
    first_foot_ = first_foot(event, steps);
    if (!at_shared(event, first_foot_) && step_.fraction == 0.0 && moves_along(event, first_foot_)) {
      reported_.stay(now_.time.value);  // what pulls the foot along has jumped as the run began
    }
    if (!at_shared(event, first_foot_)) {
      const Shown<Row>& shown = shown_at_end();
      take_moment(event, first_foot_, now_.mode->is_held[first_foot_] ? shown.pull[first_foot_] : shown.gap[first_foot_]);
    }
    move_with_moment();
    move_end();
  }

  double plain_gap(int i) const {
    double gap = dot(now_.mode->outputs + size_t(i) * sizes_.state(), end_) + now_.feed_bias(i).value;
    for (int k : now_.mode->stuck) gap += now_.mode->feed[i * sizes_.inputs() + sizes_.feet + k] * now_.places[k].value;
    return gap;
  }
  bool at_ground(int i) const { return std::fabs(plain_gap(i)) <= 10.0 * (settings_.gap_zero + settings_.gap); }

  // The gap of a free foot. It grazes where it would dip below the ground by no more than some errors of a gap.
  Margin gap_margin(int i, const Row& shown) const {
    const double rate = dot(now_.mode->outputs + size_t(i) * sizes_.state(), rate_);
    const double curve = bend_of(i, step_.fraction) / (step_.length * step_.length);
    return {shown, rate, reported_.gap_grazes(rate, curve)};
  }

  // How fast an output changes at the end of the step.
  double output_rate(int output) const {
    const int ni = sizes_.inputs();
    double out = dot(now_.mode->outputs + size_t(output) * sizes_.state(), rate_);
    const Weights weights(nodes_, step_.fraction);
    for (int k : acting_) {
      const double v1 = weighted(weights.slope, value_.input(k)), v2 = weighted(weights.bend, value_.input(k));
      out += (v1 * now_.mode->feed[output * ni + k] + v2 * now_.mode->feed_rate[output * ni + k] / step_.length) / step_.length;
    }
    return out;
  }

  // Of a foot that slides its rate in the direction of the slide; of one that sticks the friction bound less the pull along the ground.
  Margin along_margin(int i) {
    const int m = sizes_.feet, n = sizes_.coordinates;
    const Shown<Row>& shown = shown_at_end();
    if (!now_.mode->is_stuck[i]) {
      Row by = Row(0.0);
      for (int r = 0; r < n; r++) by += shown.place[n + r] * book_.tangents[size_t(i) * n + r];
      const double rate = output_rate(m + i);
      return {by, rate, rate == 0.0};
    }
    Shown<double>& value = by_structure_;
    show(*now_.mode, nodes_, step_.length, step_.fraction, acting_, value_, end_, value);
    const double sign = value.friction[i] < 0.0 ? 1.0 : -1.0;  // of the force along the ground, which friction holds back
    const int c = channel_of(i);
    const Jet at(now_.time.value), later = jet(at.value, Row(1.0)), volts = drive_at(c, at);
    const Jet rising = jet(volts.value, slope_of(drive_at(c, later)) - slope_of(volts));
    const Jet age = jet(at.value - now_.since[i].value, Row(1.0));
    const auto bound = [&](LawTangents& laws, const Jet& aged, const Jet& driven, const Jet& time, const Row& pull) {
      const Jet held = laws.has(i, HAS_LATCH) ? laws.strength(i, aged, driven) : Jet(0.0);
      return slope_of(laws.friction(i, holds(laws, i, aged, driven, time) - jet(value.pull[i], pull), held, Jet(0.0)));
    };
    const Row by = bound(laws_, at - now_.since[i], volts, at, shown.pull[i]) + shown.friction[i] * sign;
    const double rate = bound(fixed_laws_, age, rising, later, Row(output_rate(i)))[0] - sign * output_rate(m + i);
    return {by, rate, reported_.force_grazes(rate)};
  }

  // What still holds a held foot: strength less smooth force less pull.
  Margin hold_margin(int i, const Row& shown) {
    const double pulling = output_rate(i);
    const int c = channel_of(i);
    const Jet at(now_.time.value), later = jet(at.value, Row(1.0)), volts = drive_at(c, at);
    const Row by = slope_of(holds(laws_, i, at - now_.since[i], volts, at)) - shown;
    const Jet age = jet(at.value - now_.since[i].value, Row(1.0));
    const Jet rising = jet(volts.value, slope_of(drive_at(c, later)) - slope_of(volts));
    const double rate = holds(fixed_laws_, i, age, rising, later).slope[0] - pulling;
    return {by, rate, reported_.force_grazes(rate)};
  }

  // Pull that breaks the contact of a held foot off.
  static Jet holds(LawTangents& laws, int i, const Jet& age, const Jet& volts, const Jet& time) {
    Jet out(0.0);
    if (laws.has(i, HAS_LATCH)) out = laws.strength(i, age, volts);
    if (laws.has(i, HAS_FORCE)) out = out - laws.force(i, Jet(0.0), Jet(0.0), volts, time);
    return out;
  }

  // An event of the run. An impact that is the second of two at one moment has a moment of its own where
  // the two need not stay together and do not touch each other; where they do, theirs is one impact (modal/together.hpp), which is not
  // followed, and there is no derivative.
  void apply(size_t event) {
    const Event& e = record_->events[event];
    const int foot = int(e.foot);
    const EventKind kind = EventKind(int(e.kind));
    const bool lands = kind == BOUNCE || kind == CAPTURE || kind == REST || kind == AVERAGED_CONTACT;
    const Row off = lands && foot != first_foot_ ? coincidence(foot) : Row(0.0);
    Row apart = Row(0.0);
    bool independent = true;
    for (int other : landed_) independent = independent && now_.independent(foot, other);
    if (lands && !independent) {
      reported_.flag(event, SIMULTANEOUS);
    } else if (any_less(Row(0.0), magnitude(off))) {
      apart = -off / now_.rate_at_ground(foot);
      reported_.flag(event, APART);
      now_.shift_moment(apart);
    }
    const EventNumbers<Jet> found = now_.apply(kind, foot, has_numbers(e));
    reported_.put(event, foot, found);
    reported_.restart(foot, slope_of(now_.time));
    if (found.doubtful) reported_.flag(event, AT_THRESHOLD);
    if (any_less(Row(0.0), magnitude(apart))) now_.shift_moment(-apart);
    if (lands) landed_.push_back(foot);
  }

  // How the gap of a foot that lands moves at an instant, where it does: beyond rounding of its terms.
  Row coincidence(int foot) const {
    const Row found = slope_of(now_.gap_of(foot));
    Row size = magnitude(slope_of(now_.feed_bias(foot)));
    for (int k = 0; k < sizes_.state(); k++) {
      size += magnitude(slope_of(now_.product(&ContactMode::outputs, size_t(foot) * sizes_.state() + k, now_.w[k])));
    }
    Row out = Row(0.0);
    for (int lane = 0; lane < LANES; lane++) {
      if (std::fabs(found[lane]) > 1e-6 * size[lane]) out.set(lane, found[lane]);
    }
    return out;
  }
};

}  // namespace tarsus::modal
