// Derivatives of one number of a recorded run by all of its data at once: backwards over its steps and events.
//
// Steps are those of derive/adjoint_force.hpp; instants take the transposed matrices of derive/adjoint_instant.hpp.
#pragma once
#include "derive/adjoint_force.hpp"

namespace tarsus::modal {

class ModalAdjoint : StepAdjoint {
 public:
  // data: of the lenses; the rest as there.
  ModalAdjoint(Book& book, const Nodes& nodes, const Halves& halves, const Signals& signals, const Laws& laws, const Settings& settings,
               const RunData& run, const Beginning& start, const std::vector<DataTangents>& data, size_t channels,
               const std::vector<int64_t>& groups, const std::vector<int64_t>& degrees, const Directions& directions)
      : StepAdjoint(book, nodes, halves, signals, laws, settings, run, start, data, channels, groups, degrees, directions) {
    for (size_t b = 1; b < data.size(); b++) {
      others_.push_back(std::make_unique<Lens>(book, nodes, halves, signals, laws, settings, run, start, data[b], channels, directions,
                                               int(b) * LANES));
    }
  }

  AdjointResult run(const RunRecord& record, const Objective& objective) {
    objective_ = &objective;
    follow(record);
    for (auto& one : others_) one->follow(record);
    forward();
    if (!result_.refused) backward();
    result_.flags = told.flags;
    return std::move(result_);
  }

 private:
  std::vector<std::unique_ptr<Lens>> others_;

  // ---- forwards: where the run was, and the maps of its instants

  void forward() {
    begun_ = now_.time.value;
    passed_.cursors = drives_.player.cursor;
    passed_.moved = {0};
    drives_.jumps_at(now_.time.value, [&](int c, const Cursor& at) {
      result_.edges.insert(result_.edges.end(), {at.piece, at.turns, int64_t(c)});
    });
    passed_.instants.emplace_back();
    passed_.instants.back().blocks.resize(1 + others_.size());
    size_t event = gone_through(0, 0), sample = 0;
    Recording steps(book_, record_->trace);
    for (size_t r = 0; r < record_->rows && !result_.refused; r++) {
      const Recorded step = steps.step(r);
      if (step.mode != now_.mode) result_.refused = true;
      if (result_.refused) return;
      seek(step, r);
      passed_.events.push_back(event);
      passed_.samples.push_back(sample);
      const bool last = r + 1 == record_->rows;
      const double next = last ? INF : steps.row(r + 1)[0];
      while (sample < objective_->count && (last || objective_->times[sample] < next)) sample++;
      const bool happens = same_instant(event, r + 1);
      if (moving_ || happens) take(step);
      if (moving_) {
        each_lens([&](Lens& lens, std::vector<Row>& to) {
          if (&lens != this) lens.take_from(*this);
          lens.arrive(to);
        });
      }
      now_.time = Jet(step.time + step.length * step.fraction);
      if (happens) event = gone_through(event, r + 1);
    }
    passed_.samples.push_back(sample);
  }

  void take(const Recorded& step) {
    take_step(step);
    find_tables();
  }

  template <class See>
  void each_lens(See&& see) {
    std::vector<std::vector<Row>>& blocks = passed_.instants.back().blocks;
    see(static_cast<Lens&>(*this), blocks[0]);
    for (size_t b = 0; b < others_.size(); b++) see(*others_[b], blocks[1 + b]);
  }

  // The channels at the start of a step, and what kinks they pass there.
  void seek(const Recorded& step, size_t r) {
    bool moved = false;
    for (size_t c = 0; c < channels_; c++) {
      Cursor& now = drives_.player.cursor[c];
      const Cursor was = now;
      drives_.player.seek(int(c), step.time);
      moved = moved || was.piece != now.piece || was.turns != now.turns;
      if (moving_ || !drives_.passed(was, now, step.time)) continue;
      passed_.kinks.push_back({r, int(c)});
      shared_at_ = step.time;
    }
    if (!moved) return;
    passed_.cursors.insert(passed_.cursors.end(), drives_.player.cursor.begin(), drives_.player.cursor.end());
    passed_.moved.push_back(r);
  }

  // As ModalTangent::happen.
  size_t gone_through(size_t event, size_t steps) {
    const bool begun = moving_;
    if (same_instant(event, steps)) end_values();
    for (; same_instant(event, steps); event++) {
      if (record_->notes[event].origin == MARKED) {
        mark(event);
        continue;
      }
      if (!moving_) {
        InstantMap map;
        map.foot = first_foot(event, steps);
        const bool shared = at_shared();
        map.steps = steps;
        map.blocks.resize(1 + others_.size());
        for (auto& one : map.blocks) one.reserve(2 * TOLD + 1 + sizes_.feet + sizes_.state());
        passed_.instants.push_back(std::move(map));
        for (auto& one : others_) one->begin(*this, event, steps, shared);
        begin(*this, event, steps, shared);
      }
      passed_.instants.back().events.push_back(event);
      each_lens([&](Lens& lens, std::vector<Row>& to) { lens.happen(event, to); });
    }
    if (moving_ && (!begun || steps == 0)) {
      each_lens([](Lens& lens, std::vector<Row>& to) { lens.leave(to); });
    }
    for (const TangentFlag& one : told.flags) result_.refused |= one.reason == SIMULTANEOUS;
    for (auto& one : others_) {
      for (const TangentFlag& flag : one->told.flags) result_.refused |= flag.reason == SIMULTANEOUS;
    }
    return event;
  }

  void mark(size_t event) {
    const Event& e = record_->events[event];
    const double* row = now_.mode->outputs + size_t(e.foot) * sizes_.state();
    passed_.marks.push_back({event, turns_of(e), dot(row, rate_), plain_gap(int(e.foot)), e.apex_time == e.time && e.apex > 0.0});
  }

  // ---- backwards

  void backward() {
    size_t end = record_->count;
    Recording steps(book_, record_->trace);
    for (size_t r = record_->rows; r-- > 0;) {
      const Recorded step = steps.step(r);
      end = happened(end, r + 1, step.time + step.length * step.fraction);
      take(step);
      std::copy_n(cursors(), channels_, drives_.player.cursor.begin());
      for (int i : smooth_) {
        const int c = i < sizes_.feet ? -1 : channel_of(i - sizes_.feet);
        if (c >= 0) drives_.player.fill(c, step.time, step.length, &channel_values_[N * c]);
      }
      go_back(r);
      leave_place(r);
    }
    happened(end, 0, begun_);
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

  // What happened after so many steps, at a time, before event number ``end``. Returns the number of the first of that.
  size_t happened(size_t end, size_t steps, double time) {
    InstantMap* map = passed_.instants.empty() || passed_.instants.back().steps != steps ? nullptr : &passed_.instants.back();
    size_t place = map == nullptr ? 0 : map->events.size();
    if (map != nullptr) {
      out_by_.assign(place * TOLD, 0.0);
      out_by_.push_back(by_shared_);
      out_by_.insert(out_by_.end(), by_since_.begin(), by_since_.end());
      out_by_.insert(out_by_.end(), by_state_.begin(), by_state_.end());
    }
    margin_ = 0.0;
    size_t event = end;
    while (event > 0 && same_instant(event - 1, steps)) {
      event--;
      const double* by = objective_->events + event * EVENT_WIDTH;
      const int foot = int(record_->events[event].foot);
      if (record_->notes[event].origin == MARKED) {
        marked(by, foot);
      } else {
        double* told = &out_by_[--place * TOLD];
        told[0] = by[0];
        std::copy_n(by + 3, 6, told + 1);
        told[7] = apex_time_[foot];
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
    const Directions& of = of_;
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
    std::copy_n(&in[of.since], sizes_.feet, by_since_.begin());
    for (size_t c = 0; c < channels_; c++) {
      if (in[of.channels + c] != 0.0) back_.value(int(c), cursors()[c], time, in[of.channels + c], to);
    }
    for (size_t q = 0; q < to.sources.size(); q++) to.sources[q] += in[of.sources + q];
    for (size_t g = 0; g < to.groups.size(); g++) to.groups[g] += in[of.groups + g];
    passed_.instants.pop_back();
  }

  // Kinks that moved the state at the start of a step.
  void pass_kinks_back(size_t r) {
    for (; !passed_.kinks.empty() && passed_.kinks.back().row == r; passed_.kinks.pop_back()) {
      const int c = passed_.kinks.back().channel;
      double by = by_shared_;
      by_shared_ = 0.0;
      const double before = drives_.value(c, cursors(1)[c], Jet(step_.time)).value;
      const double after = drives_.value(c, cursors()[c], Jet(step_.time)).value;
      each_jump(c, before, after, [&](int k, double rate) { by += by_state_[k] * rate; });
      back_.beginning(c, cursors()[c], by, result_.data);
    }
  }
};

// The derivatives of a number by all data of a run. nothing: of the sizes of the data.
inline AdjointResult adjoint(Book& book, const Nodes& nodes, const Halves& halves, const Signals& signals, const Laws& laws,
                             const Settings& settings, const RunData& run, const Beginning& start, const DataTangents& nothing,
                             size_t channels, const std::vector<int64_t>& groups, const std::vector<int64_t>& degrees,
                             const RunRecord& record, const Objective& objective) {
  const int64_t most = groups.empty() ? -1 : *std::max_element(groups.begin(), groups.end());
  const Directions directions(book.sizes, channels, int(most + 1));
  std::vector<DataTangents> data;
  for (int b = 0; b < directions.blocks(); b++) data.push_back(Lens::data(nothing, directions, b * LANES, groups));
  ModalAdjoint march(book, nodes, halves, signals, laws, settings, run, start, data, channels, groups, degrees, directions);
  return march.run(record, objective);
}

}  // namespace tarsus::modal
