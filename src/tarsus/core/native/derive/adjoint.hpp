// Derivatives of one number of a recorded run by all of its data at once: backwards over its steps and events.
//
// An instant's maps are matrices, made eight directions at a time by the maps that tangents take (derive/modal.hpp): a run has few
// instants for its steps, and few directions enter one. A step's tangents solve (1 - G S) dy = L dw + G own, and everything after
// it is linear in them. Of a number J whose derivatives by the results of the step are known, those by its data follow from
//   (1 - G S)^T mu = S^T u + (derivatives of J by the gaps),   u: derivatives of J by the forces,
// and those by the data from what these do to forces, drives and sources at the nodes.
#pragma once
#include "derive/adjoint_step.hpp"
#include "derive/modal.hpp"

namespace tarsus::modal {

// What may move before an instant, one number after the other: the moment that it shares with what was there just before it;
// the gap or pull that its own moment depends on, at a fixed time; the flowing state (at the start of a run the place);
// since when feet are held; values of the channels; sources; groups of parameters of the laws.
struct Directions {
  int since, channels, sources, groups, count;
  static constexpr int SHARED = 0, MARGIN = 1, STATE = 2;

  Directions(const Sizes& s, size_t driven, int parameters)
      : since(STATE + s.state()), channels(since + s.feet), sources(channels + int(driven)), groups(sources + s.sources()),
        count(groups + parameters) {}
  int blocks() const { return (count + LANES - 1) / LANES; }
};

constexpr int REPORTED = 8;  // numbers of an event: those of EventNumbers, and the moment at which a flight begins

// Eight of the directions, from ``first`` on.
class Lens : public ModalTangent {
 public:
  Lens(Book& book, const Nodes& nodes, const Signals& signals, const Laws& laws, const Settings& settings,
       const RunData& run, const Beginning& start, const DataTangents& data, size_t channels, const Directions& of, int first)
      : ModalTangent(book, nodes, signals, laws, settings, run, start, data, channels, {}), of_(of), first_(first) {}

  static DataTangents data(const DataTangents& nothing, const Directions& of, int first, const Signals& signals,
                           const int64_t* channels, const std::vector<int64_t>& groups) {
    DataTangents out = nothing;
    const auto mark = [&](std::vector<Row>& rows, int begin) {
      for (size_t k = 0; k < rows.size(); k++) rows[k] = unit(begin + int(k) - first);
    };
    mark(out.initial, Directions::STATE);
    mark(out.since, of.since);
    mark(out.sources, of.sources);
    for (int c = of.channels; c < of.sources; c++) {  // what is constant of every piece moves the value alone
      const int64_t channel = channels[c - of.channels];
      for (int64_t p = signals.first[channel]; p < signals.first[channel + 1]; p++) out.coef[DEGREE * p] += unit(c - first);
    }
    for (size_t k = 0; k < groups.size(); k++) {
      if (groups[k] >= 0) out.parameters[k] = unit(of.groups + int(groups[k]) - first);
    }
    return out;
  }

  static Row unit(int lane) {
    Row out = Row(0.0);
    if (0 <= lane && lane < LANES) out.set(lane, 1.0);
    return out;
  }

  void follow(const RunRecord& record) {
    record_ = &record;
  }

  // The group of parameters whose direction a lane is; none where negative or too large.
  int group(int lane) const { return first_ + lane - of_.groups; }

  // Where the run is: a step of it that another has taken.
  void take_from(const Lens& run) {
    step_ = run.step_;
    tables_ = run.tables_;
    gaps_ = run.gaps_;
    value_ = run.value_;
    acting_ = run.acting_;
    drives_.player.cursor = run.drives_.player.cursor;
  }

  void begin(const Lens& run, size_t event, size_t steps, bool shared) {
    if (&run != this) {
      take_from(run);
      end_ = run.end_;
      rate_ = run.rate_;
      reported_.shared_at = run.reported_.shared_at;
    }
    now_.time = Jet(run.now_.time.value);
    for (int k = 0; k < sizes_.state(); k++) dw_[k] = unit(Directions::STATE + k - first_);
    for (int i = 0; i < sizes_.feet; i++) now_.since[i] = jet(now_.since[i].value, unit(of_.since + i - first_));
    landed_.clear();
    event_ = event;
    first_foot_ = first_foot(event, steps);
    reported_.shared = unit(Directions::SHARED - first_);
    if (!shared) take_moment(event, first_foot_, unit(Directions::MARGIN - first_));
    move_with_moment();
  }

  void apply_event(size_t event, std::vector<Row>& to) {
    event_ = event;
    apply(event);
    const Row* numbers = &reported_.events[event * EVENT_WIDTH];
    to.push_back(numbers[0]);
    to.insert(to.end(), numbers + 3, numbers + 9);
    to.push_back(reported_.feet[int(record_->events[event].foot)].apex_time);
  }

  // What comes out at the end of an instant but for its events: states come with the next step.
  void leave(std::vector<Row>& to) const {
    to.push_back(reported_.shared);
    for (int i = 0; i < sizes_.feet; i++) to.push_back(slope_of(now_.since[i]));
  }
  void arrive(std::vector<Row>& to) {
    end_instant();
    to.insert(to.end(), dw_.begin(), dw_.end());
  }

 private:
  const Directions& of_;
  const int first_;
};

// One instant, after so many steps: its events but for marks; the foot that it began with (-1 at the start of a run); and of
// every eight directions the rows of its matrix: the events' numbers, the moment that is shared, since when feet are held, the
// state after it.
struct InstantMap {
  size_t steps = 0;
  int foot = -1;
  std::vector<size_t> events;
  std::vector<std::vector<Row>> blocks;
};

// The lists of instants and steps that the way back needs in addition to the record of the run.
struct Passed {
  struct Mark {
    size_t event;
    double turns, rate, gap;  // turns: of the period, 0 where it is no end of one; rate of the highest gap at the mark
    bool rising;
  };
  struct Kink {
    size_t row;
    int channel;
  };
  std::vector<InstantMap> instants;
  std::vector<Mark> marks;
  std::vector<Kink> kinks;
  std::vector<Cursor> cursors;          // (places, channels): before the first step, and wherever one moves
  std::vector<size_t> moved;            // (places): the first step that has them
  std::vector<size_t> events, samples;  // of every step: number of the first event after it, of the first sample in it
};

// The way back over a run. Its lenses go through its instants forwards first, the first of them, the run itself, through its steps.
class ModalAdjoint {
  typedef ModalTangent::Smooth Smooth;

 public:
  // lens(b) makes that of eight directions; degrees: see DrivesBack.
  template <class Make>
  ModalAdjoint(const Directions& of, const Signals& signals, const std::vector<int64_t>& degrees, size_t channels, Make&& lens)
      : of_(of), lenses_(made(of, lens)), run_(*lenses_[0]), sizes_(run_.sizes_), channels_(channels),
        back_(signals, run_.nodes_, run_.run_, degrees), bar_(sizes_), unit_(sizes_), seed_(sizes_), by_channel_(channels * N) {
    const int m = sizes_.feet;
    DataAdjoint& to = result_.data;
    to.groups.assign(of.count - of.groups, 0.0);
    to.initial.assign(2 * sizes_.coordinates, 0.0);
    to.sources.assign(sizes_.sources(), 0.0);
    to.coef.assign(signals.coef.size(), 0.0);
    to.begin.assign(signals.start.size(), 0.0);
    to.end = to.begin;
    to.loops.assign(signals.loop.size(), 0.0);
    by_state_ = nothing_ = std::vector<double>(sizes_.state(), 0.0);
    for (auto* one : {&by_since_, &apex_, &apex_time_, &integral_}) one->assign(m, 0.0);
    by_gap_.assign(m, Row(0.0));
    next_.assign(m, 0);
  }

  AdjointResult run(const RunRecord& record, const Objective& objective) {
    objective_ = &objective;
    for (auto& one : lenses_) one->follow(record);
    forward();
    if (!result_.refused) backward();
    result_.flags = run_.reported_.flags;
    return std::move(result_);
  }

 private:
  const Directions& of_;
  std::vector<std::unique_ptr<Lens>> lenses_;
  Lens& run_;
  const Sizes sizes_;
  const size_t channels_;
  std::vector<size_t> next_;  // of each foot, the number of the next event
  DrivesBack back_;
  const Objective* objective_ = nullptr;
  AdjointResult result_;
  Passed passed_;
  Entering<double> bar_;
  Entering<Row> unit_;  // directions of what enters a step
  Shown<double> seed_;
  // Derivatives of the number by: the state; since when feet are held; of the flights that end next, the highest gaps and when,
  // and the integrals; outputs and inputs of an instant; channels, and right sides, at the nodes.
  std::vector<double> nothing_, by_state_, by_since_, apex_, apex_time_, integral_, out_by_, in_by_, by_channel_, right_by_;
  std::vector<Row> by_gap_, forces_by_;
  // What is shown at a moment, of directions and of the number.
  static constexpr std::pair<std::vector<Row> Shown<Row>::*, std::vector<double> Shown<double>::*> SHOWN_PARTS[] = {
      {&Shown<Row>::place, &Shown<double>::place},         {&Shown<Row>::gap, &Shown<double>::gap},
      {&Shown<Row>::rate, &Shown<double>::rate},           {&Shown<Row>::resistive, &Shown<double>::resistive},
      {&Shown<Row>::smooth, &Shown<double>::smooth}, {&Shown<Row>::pull, &Shown<double>::pull}};
  double begun_ = 0.0;                     // start of the run [s]
  double by_shared_ = 0.0, margin_ = 0.0;  // by the moment last shared; by the gap or pull of a foot at the end of the step
  int margin_foot_ = 0;

  template <class Make>
  static std::vector<std::unique_ptr<Lens>> made(const Directions& of, Make& lens) {
    std::vector<std::unique_ptr<Lens>> out;
    for (int b = 0; b < of.blocks(); b++) out.push_back(lens(b));
    return out;
  }

  // ---- forwards: where the run was, and the maps of its instants

  void forward() {
    begun_ = run_.now_.time.value;
    passed_.cursors = run_.drives_.player.cursor;
    passed_.moved = {0};
    run_.drives_.jumps_at(run_.now_.time.value, [&](int c, const Cursor& at) {
      result_.edges.insert(result_.edges.end(), {at.piece, at.turns, int64_t(c)});
    });
    passed_.instants.emplace_back();
    passed_.instants.back().blocks.resize(lenses_.size());
    size_t event = gone_through(0, 0), sample = 0;
    Recording steps(run_.book_, run_.record_->trace);
    for (size_t r = 0; r < run_.record_->rows && !result_.refused; r++) {
      const Recorded step = steps.step(r);
      if (step.mode != run_.now_.mode) result_.refused = true;
      if (result_.refused) return;
      seek(step, r);
      passed_.events.push_back(event);
      passed_.samples.push_back(sample);
      const bool last = r + 1 == run_.record_->rows;
      const double next = last ? INF : steps.row(r + 1)[0];
      while (sample < objective_->count && (last || objective_->times[sample] < next)) sample++;
      const bool ends_with_event = run_.same_instant(event, r + 1);
      if (run_.moving_ || ends_with_event) take(step);
      if (run_.moving_) {
        each_lens([&](Lens& lens, std::vector<Row>& to) {
          if (&lens != &run_) lens.take_from(run_);
          lens.arrive(to);
        });
      }
      run_.now_.time = Jet(step.time + step.length * step.fraction);
      if (ends_with_event) event = gone_through(event, r + 1);
    }
    passed_.samples.push_back(sample);
  }

  void take(const Recorded& step) {
    run_.take_step(step);
    run_.find_tables();
  }

  template <class See>
  void each_lens(See&& see) {
    std::vector<std::vector<Row>>& blocks = passed_.instants.back().blocks;
    for (size_t b = 0; b < lenses_.size(); b++) see(*lenses_[b], blocks[b]);
  }

  // The channels at the start of a step, and what kinks they pass there.
  void seek(const Recorded& step, size_t r) {
    bool moved = false;
    for (size_t c = 0; c < channels_; c++) {
      Cursor& now = run_.drives_.player.cursor[c];
      const Cursor was = now;
      run_.drives_.player.seek(int(c), step.time);
      moved = moved || was.piece != now.piece || was.turns != now.turns;
      if (run_.moving_ || !run_.drives_.passed(was, now, step.time)) continue;
      passed_.kinks.push_back({r, int(c)});
      run_.reported_.shared_at = step.time;
      run_.reported_.by_kink = true;
    }
    if (!moved) return;
    passed_.cursors.insert(passed_.cursors.end(), run_.drives_.player.cursor.begin(), run_.drives_.player.cursor.end());
    passed_.moved.push_back(r);
  }

  // As ModalTangent::apply_events.
  size_t gone_through(size_t event, size_t steps) {
    const bool begun = run_.moving_;
    if (run_.same_instant(event, steps)) run_.end_values();
    for (; run_.same_instant(event, steps); event++) {
      if (run_.record_->notes[event].origin == MARKED) {
        mark(event);
        continue;
      }
      if (!run_.moving_) {
        InstantMap map;
        map.foot = run_.first_foot(event, steps);
        const bool shared = run_.at_shared(event, map.foot);
        map.steps = steps;
        map.blocks.resize(lenses_.size());
        for (auto& one : map.blocks) one.reserve(2 * REPORTED + 1 + sizes_.feet + sizes_.state());
        passed_.instants.push_back(std::move(map));
        for (size_t b = lenses_.size(); b-- > 0;) lenses_[b]->begin(run_, event, steps, shared);  // the run's own last
      }
      passed_.instants.back().events.push_back(event);
      each_lens([&](Lens& lens, std::vector<Row>& to) { lens.apply_event(event, to); });
    }
    if (run_.moving_ && (!begun || steps == 0)) {
      each_lens([](Lens& lens, std::vector<Row>& to) { lens.leave(to); });
    }
    for (auto& one : lenses_) {
      for (const TangentFlag& flag : one->reported_.flags) result_.refused |= flag.reason == SIMULTANEOUS;
    }
    return event;
  }

  void mark(size_t event) {
    const Event& e = run_.record_->events[event];
    const double* row = run_.now_.mode->outputs + size_t(e.foot) * sizes_.state();
    passed_.marks.push_back({event, run_.reported_.turns_at(e.time), dot(row, run_.rate_), run_.plain_gap(int(e.foot)), run_.rises_at(e)});
  }

  // ---- backwards

  void backward() {
    size_t end = run_.record_->count;
    Recording steps(run_.book_, run_.record_->trace);
    for (size_t r = run_.record_->rows; r-- > 0;) {
      const Recorded step = steps.step(r);
      end = events_back(end, r + 1, step.time + step.length * step.fraction);
      take(step);
      std::copy_n(cursors(), channels_, run_.drives_.player.cursor.begin());
      for (int i : run_.smooth_) {
        const int c = i < sizes_.feet ? -1 : run_.channel_of(i - sizes_.feet);
        if (c >= 0) run_.drives_.player.fill(c, step.time, step.length, &run_.channel_values_[N * c]);
      }
      go_back(r);
      leave_place(r);
    }
    events_back(end, 0, begun_);
    for (size_t q = 0; q < bar_.sources.size(); q++) result_.data.sources[q] += bar_.sources[q];
  }

  // The channels where the way back has come to; ``before``: one place earlier.
  const Cursor* cursors(size_t before = 0) const { return passed_.cursors.data() + (passed_.moved.size() - 1 - before) * channels_; }

  // From the start of a step, kinks that moved the state there passed, to the end of the one before.
  void leave_place(size_t r) {
    pass_kinks_back(r);
    if (passed_.moved.back() < r || passed_.moved.size() == 1) return;
    passed_.moved.pop_back();
    passed_.cursors.resize(passed_.cursors.size() - channels_);
  }

  // Back over the events after so many steps, at a time, before event number ``end``. Returns the number of the first of them.
  size_t events_back(size_t end, size_t steps, double time) {
    InstantMap* map = passed_.instants.empty() || passed_.instants.back().steps != steps ? nullptr : &passed_.instants.back();
    size_t place = map == nullptr ? 0 : map->events.size();
    if (map != nullptr) {
      out_by_.assign(place * REPORTED, 0.0);
      out_by_.push_back(by_shared_);
      out_by_.insert(out_by_.end(), by_since_.begin(), by_since_.end());
      out_by_.insert(out_by_.end(), by_state_.begin(), by_state_.end());
    }
    margin_ = 0.0;
    size_t event = end;
    while (event > 0 && run_.same_instant(event - 1, steps)) {
      event--;
      const double* by = objective_->events + event * EVENT_WIDTH;
      const int foot = int(run_.record_->events[event].foot);
      if (run_.record_->notes[event].origin == MARKED) {
        marked(by, foot);
      } else {
        double* reported = &out_by_[--place * REPORTED];
        reported[0] = by[0];
        std::copy_n(by + 3, 6, reported + 1);
        reported[7] = apex_time_[foot];
        apex_time_[foot] = by[10];
      }
      apex_[foot] = by[9];
      integral_[foot] += by[11];
      next_[foot] = event;
    }
    if (map != nullptr) transpose(*map, time);
    return event;
  }

  void marked(const double* by, int foot) {
    const Passed::Mark& mark = passed_.marks.back();
    double moment = by[0] + apex_time_[foot] + by[11] * mark.gap;
    if (mark.rising) moment += by[9] * mark.rate + by[10];
    result_.data.period += mark.turns * moment;
    apex_time_[foot] = mark.rising ? 0.0 : by[10];
    passed_.marks.pop_back();
  }

  // From what came out of an instant, ``out_by_``, to what went into it.
  void transpose(const InstantMap& map, double time) {
    std::vector<double>& in = in_by_;
    in.assign(map.blocks.size() * LANES, 0.0);
    for (size_t b = 0; b < map.blocks.size(); b++) {
      Row sum = Row(0.0);
      const std::vector<Row>& rows = map.blocks[b];
      for (size_t n = 0; n < rows.size(); n++) {
        if (out_by_[n] != 0.0) sum += rows[n] * out_by_[n];
      }
      store(&in[b * LANES], sum);
    }
    by_shared_ = in[Directions::SHARED];
    margin_ = in[Directions::MARGIN];
    margin_foot_ = map.foot;
    DataAdjoint& to = result_.data;
    const double* state = &in[Directions::STATE];
    if (map.steps == 0) {
      for (size_t k = 0; k < to.initial.size(); k++) to.initial[k] += state[k];
    }
    std::copy_n(state, sizes_.state(), by_state_.begin());
    std::copy_n(&in[of_.since], sizes_.feet, by_since_.begin());
    for (size_t c = 0; c < channels_; c++) {
      if (in[of_.channels + c] != 0.0) back_.value(int(c), cursors()[c], time, in[of_.channels + c], to);
    }
    for (size_t q = 0; q < to.sources.size(); q++) to.sources[q] += in[of_.sources + q];
    for (size_t g = 0; g < to.groups.size(); g++) to.groups[g] += in[of_.groups + g];
    passed_.instants.pop_back();
  }

  // Kinks that moved the state at the start of a step.
  void pass_kinks_back(size_t r) {
    for (; !passed_.kinks.empty() && passed_.kinks.back().row == r; passed_.kinks.pop_back()) {
      const int c = passed_.kinks.back().channel;
      double by = by_shared_;
      by_shared_ = 0.0;
      const double before = run_.drives_.value(c, cursors(1)[c], Jet(run_.step_.time)).value;
      const double after = run_.drives_.value(c, cursors()[c], Jet(run_.step_.time)).value;
      run_.each_jump(c, before, after, [&](int k, double rate) { by += by_state_[k] * rate; });
      back_.beginning(c, cursors()[c], by, result_.data);
    }
  }

  // ---- a step

  // From the end of a step to its start.
  void go_back(size_t r) {
    const ContactMode& mode = *run_.step_.mode;
    const bool whole = run_.step_.fraction == 1.0;
    std::fill(bar_.inputs.begin(), bar_.inputs.end(), 0.0);
    std::fill(bar_.state.begin(), bar_.state.end(), 0.0);
    if (margin_ != 0.0 || !whole) {
      (mode.is_held[margin_foot_] ? seed_.pull : seed_.gap)[margin_foot_] = margin_;
      moment_back(run_.step_.fraction, whole ? nothing_ : by_state_);
    }
    if (whole) {
      end_back(*run_.tables_, run_.acting_, by_state_.data(), bar_);
    } else {
      by_state_ = nothing_;
    }
    for (size_t n = passed_.samples[r]; n < passed_.samples[r + 1]; n++) sampled(n);
    tracked(r);
    linearise_back();
    for (int k = 0; k < sizes_.state(); k++) by_state_[k] += bar_.state[k];
  }

  // What is there at scaled time s of the step, by its state and by ``seed_``, which is left at nothing: the way there on eight
  // unit directions at a time.
  void moment_back(double s, const std::vector<double>& by_state) {
    const ContactMode& mode = *run_.step_.mode;
    std::vector<std::pair<Row*, double*>> entries;
    for (int k = 0; k < sizes_.state(); k++) entries.push_back({&unit_.state[k], &bar_.state[k]});
    for (int i : run_.acting_) {
      for (int j = 0; j < N; j++) entries.push_back({unit_.input(i) + j, bar_.input(i) + j});
    }
    for (int q = 0; q < sizes_.sources(); q++) entries.push_back({&unit_.sources[q], &bar_.sources[q]});
    for (size_t first = 0; first < entries.size(); first += LANES) {
      const size_t last = std::min(first + LANES, entries.size());
      for (size_t n = first; n < last; n++) *entries[n].first = Lens::unit(int(n - first));
      within_step(run_.book_, run_.nodes_, mode, run_.step_.step_class, s, run_.acting_, unit_, run_.slope_room_, run_.inside_);
      show(mode, run_.nodes_, run_.step_.length, s, run_.acting_, unit_, run_.inside_, run_.shown_);
      Row sum = Row(0.0);
      const auto add = [&](const std::vector<Row>& found, const std::vector<double>& by) {
        for (size_t k = 0; k < by.size(); k++) sum += found[k] * by[k];
      };
      add(run_.inside_, by_state);
      for (auto part : SHOWN_PARTS) add(run_.shown_.*part.first, seed_.*part.second);
      for (size_t n = first; n < last; n++) {
        *entries[n].second += sum[n - first];
        *entries[n].first = Row(0.0);
      }
    }
    for (auto part : SHOWN_PARTS) std::fill((seed_.*part.second).begin(), (seed_.*part.second).end(), 0.0);
  }

  void sampled(size_t n) {
    const double* from = objective_->samples + n * (tangent_width(sizes_));
    if (std::all_of(from, from + tangent_width(sizes_), [](double x) { return x == 0.0; })) return;
    for (auto part : SHOWN_PARTS) {
      std::vector<double>& to = seed_.*part.second;
      std::copy_n(from, to.size(), to.begin());
      from += to.size();
    }
    moment_back(std::min(std::max((objective_->times[n] - run_.step_.time) / run_.step_.length, 0.0), run_.step_.fraction), nothing_);
  }

  // As StepTangents::track.
  void tracked(size_t r) {
    Row weights = Row(0.0);
    double power = run_.step_.fraction * run_.step_.length;
    const bool none = std::all_of(integral_.begin(), integral_.end(), [](double x) { return x == 0.0; });
    for (int c = 0; c < N && !none; c++, power *= run_.step_.fraction) weights += load(run_.nodes_.monomial[c]) * (power / (c + 1));
    for (int i : run_.step_.mode->free) {
      if (run_.nearly_lands(run_.step_, i)) run_.reported_.flag(passed_.events[r], NEAR_MISS);
      by_gap_[i] = integral_[i] == 0.0 ? Row(0.0) : weights * integral_[i];
      if ((apex_[i] == 0.0 && apex_time_[i] == 0.0) || !(run_.record_->events[next_[i]].apex > 0.0)) continue;
      const double s = (run_.record_->events[next_[i]].apex_time - run_.step_.time) / run_.step_.length;
      if (!(s >= 0.0 && s <= run_.step_.fraction)) continue;
      const double bend = run_.bend_of(i, s);
      seed_.gap[i] = apex_[i];
      if (s > 0.0 && s < run_.step_.fraction && bend < 0.0) seed_.rate[i] = apex_time_[i] * (-run_.step_.length * run_.step_.length / bend);
      apex_[i] = apex_time_[i] = 0.0;
      moment_back(s, nothing_);
    }
  }

  // From the inputs and gaps at the nodes of a step, ``bar_`` and ``by_gap_``, to its state and the data.
  void linearise_back() {
    const int m = sizes_.feet;
    std::fill(by_channel_.begin(), by_channel_.end(), 0.0);
    if (!run_.smooth_.empty()) forces_back();
    for (int i : run_.step_.mode->free) {
      const bool felt = run_.laws_.has(i, HAS_MOMENTUM) || run_.laws_.has(i, HAS_FORCE);
      if (!felt && integral_[i] != 0.0) drives_back(i, by_gap_[i]);
    }
    for (size_t c = 0; c < channels_; c++) {
      double* by = &by_channel_[N * c];
      if (int(c) < sizes_.drives) store(by, load(by) + load(bar_.input(2 * m + int(c))));
      if (back_.moves(run_.drives_.player.cursor[c])) {
        back_.fill(int(c), run_.drives_.player.cursor[c], run_.step_.time, run_.step_.length, by, result_.data);
      }
    }
  }

  // An output by state, drives and sources.
  void drives_back(int output, const Row& by) {
    output_back(*run_.tables_, run_.acting_.data() + run_.smooth_.size(), run_.acting_.size() - run_.smooth_.size(), output, by, bar_);
  }

  void forces_back() {
    const int m = sizes_.feet;
    run_.solved_.clear();
    forces_by_.clear();
    for (int i : run_.smooth_) {
      run_.solved_.push_back(run_.smooth_input(run_.step_, i));
      Row by = load(bar_.input(i));
      for (int o : run_.step_.mode->free) {
        if (run_.laws_.has(o, HAS_MOMENTUM) || run_.laws_.has(o, HAS_FORCE) || integral_[o] == 0.0) continue;
        by += input_back(*run_.tables_, o, i, by_gap_[o]);
      }
      forces_by_.push_back(by);
    }
    right_by_.resize(run_.unknown_.size() * N);
    for (size_t a = 0; a < run_.unknown_.size(); a++) {
      Row by = run_.unknown_[a] < m ? by_gap_[run_.unknown_[a]] : Row(0.0);
      for (size_t n = 0; n < run_.solved_.size(); n++) {
        if (run_.solved_[n].feels(run_.unknown_[a], m)) by += run_.solved_[n].by(run_.unknown_[a], m) * forces_by_[n];
      }
      store(&right_by_[N * a], by);
    }
    if (!run_.factor_forces()) {
      result_.refused = true;
      return;
    }
    run_.solver_.solve(right_by_.data());
    for (size_t n = 0; n < run_.solved_.size(); n++) {
      for (size_t a = 0; a < run_.unknown_.size(); a++) {
        forces_by_[n] += input_back(*run_.tables_, run_.unknown_[a], run_.solved_[n].input, load(&right_by_[N * a]));
      }
    }
    for (size_t a = 0; a < run_.unknown_.size(); a++) drives_back(run_.unknown_[a], load(&right_by_[N * a]));
    for (size_t n = 0; n < run_.solved_.size(); n++) laws_back(run_.solved_[n], forces_by_[n]);
  }

  // A force at the nodes by the parameters of its laws and by its voltage.
  void laws_back(const Smooth& one, const Row& by) {
    const int m = sizes_.feet;
    const auto own = [&](LawTangents& laws, const Row* volts) {
      Row found[N], sum = Row(0.0);
      std::fill_n(found, N, Row(0.0));
      laws.add_explicit(one.hook(m), one.foot, one.arguments, one.count(m), volts, found);
      if (volts != nullptr) {
        double* channel = &by_channel_[N * one.channel];
        for (int j = 0; j < N; j++) channel[j] += found[j][0] * by[j];
      }
      for (int j = 0; j < N; j++) sum += found[j] * by[j];
      return sum;
    };
    for (auto& lens : lenses_) {
      if (!lens->laws_.varied[one.foot]) continue;
      const Row sum = own(lens->laws_, nullptr);
      for (int lane = 0; lane < LANES; lane++) {
        const int group = lens->group(lane);
        if (0 <= group && group < int(result_.data.groups.size())) result_.data.groups[group] += sum[lane];
      }
    }
    Row volts[N];
    std::fill_n(volts, N, Lens::unit(0));
    if (one.channel >= 0) own(run_.fixed_laws_, volts);
  }
};

}  // namespace tarsus::modal
