// Derivatives of a recorded run of a modal robot: a march over its own steps and events (see docs/gradients.md).
//
// Between events the state's tangents at fixed times are those of the collocated solution. At an event the state is taken
// along with its moment, which moves by dt = -dg / (dg/dt): Dw = dw + w' dt before it, the map of the event on Jets, and
// dw = Dw - w' dt after it.
#pragma once
#include "derive/step.hpp"

namespace tarsus::modal {

class ModalTangent : protected StepTangents {
 public:
  using StepTangents::StepTangents;

  TangentResult run(const RunRecord& record, const double* times, size_t count, bool keep) {
    TangentResult out;
    out.events.assign(record.count * EVENT_WIDTH, Row(0.0));
    out.samples.assign(count * (sample_width(sizes_) - sizes_.feet), Row(0.0));
    record_ = &record;
    out_ = &out;
    size_t sample = 0;
    drives_.edges_at(now_.time.value, [&](int lane) { flag(0, EDGE_AT_START, lane); });
    size_t event = happen(0, 0);
    Recording steps(book_, record.trace);
    for (size_t r = 0; r < record.rows; r++) {
      const Recorded step = steps.step(r);
      if (step.mode != now_.mode) {
        lose(event);
        break;
      }
      begin_step(step);
      linearise(step);
      if (keep) keep_step();
      const bool last = r + 1 == record.rows;
      while (sample < count && (last || times[sample] < steps.row(r + 1)[0])) {
        take_sample(step, std::min(std::max((times[sample] - step.time) / step.length, 0.0), step.fraction), sample);
        sample++;
      }
      track(step, event);
      end_step(step);
      event = happen(event, r + 1);
    }
    return out;
  }

 protected:
  // ---- events

  bool same_instant(size_t event, size_t steps) const {
    return event < record_->count && record_->notes[event].steps == double(steps);
  }

  // All events that happened when so many steps had been recorded. Returns the number of the next event.
  size_t happen(size_t event, size_t steps) {
    event_ = event;
    first_foot_ = -1;
    struck_.clear();
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

  // Which end of a period a mark is; 0 where it is that of the run.
  double turns_of(const Event& mark) const {
    const double turns = std::isfinite(settings_.period) ? std::round(mark.time / settings_.period) : 0.0;
    const bool whole = std::fabs(mark.time - turns * settings_.period) <= 1e-12 * mark.time && mark.time < settings_.end;
    return whole ? turns : 0.0;
  }

  void note_mark(size_t event) {
    const Event& e = record_->events[event];
    FootTangent& foot = feet_[int(e.foot)];
    Row* to = &out_->events[event * EVENT_WIDTH];
    to[0] = data_.period * turns_of(e);
    // what is highest at the mark itself moves with it, and the integral goes up to it
    const bool rising = e.apex_time == e.time && e.apex > 0.0;
    const double* row = now_.mode->outputs + size_t(e.foot) * sizes_.state();
    to[9] = foot.apex + (rising ? to[0] * dot(row, rate_) : Row(0.0));
    to[10] = rising ? to[0] : foot.apex_time;
    to[11] = foot.integral + to[0] * plain_gap(int(e.foot));
    foot.apex = Row(0.0);
    foot.apex_time = to[0];
  }

  // The foot whose event begins an instant.
  int first_foot(size_t event, size_t steps) const {
    const int foot = int(record_->events[event].foot);
    // an impact may have torn this foot off first, and others: then it is the impact's moment
    size_t after = event;
    while (same_instant(after, steps) && record_->events[after].kind == RELEASE) after++;
    if (after > event && same_instant(after, steps)) {
      const Event& next = record_->events[after];
      const int other = int(next.foot);
      const bool lands = next.kind != RELEASE && next.kind != CONTACT_AT_START && other != foot;
      if (lands && !now_.mode->is_held[other] && at_ground(other)) return other;
    }
    return foot;
  }

  // Whether an instant shares the moment of the last one, or of a kink.
  bool at_shared() const { return step_.fraction == 0.0 && shared_at_ >= now_.time.value - settings_.least_progress; }

  // How the moment of an event moves with what it tells: the tangents, at a fixed time, of the gap or the pull.
  void meet(size_t event, int foot, const Row& shown) {
    const Margin found = now_.mode->is_held[foot] ? hold_margin(foot, shown) : gap_margin(foot, shown);
    shared_ = -found.by / found.rate;
    shared_at_ = now_.time.value;
    // a foot that settles inside a step does so without a speed that would tell when
    if (found.grazes || record_->events[event].kind == CONTACT_AT_START) flag(event, GRAZING, -1);
  }

  // The state goes along with the moment.
  void depart() {
    now_.time = jet(now_.time.value, shared_);
    now_.w.clear();
    for (int k = 0; k < sizes_.state(); k++) now_.w.push_back(jet(end_[k], dw_[k] + shared_ * rate_[k]));
    note_drives();
    moving_ = true;
  }

  // The first event of an instant: how its moment moves, and the state with it.
  void begin_instant(size_t event, size_t steps) {
    first_foot_ = first_foot(event, steps);
    if (!at_shared()) {
      const Shown<Row>& shown = shown_at_end();
      meet(event, first_foot_, now_.mode->is_held[first_foot_] ? shown.pull[first_foot_] : shown.gap[first_foot_]);
    }
    depart();
    if (!out_->steps.empty()) out_->steps[out_->steps.size() - kept_width()] = shared_;
  }

  // An event function: its tangents at a fixed time, and its rate.
  struct Margin {
    Row by;
    double rate;
    bool grazes;
  };

  double plain_gap(int i) const {
    return dot(now_.mode->outputs + size_t(i) * sizes_.state(), end_) + now_.feed_bias(i).value;
  }
  bool at_ground(int i) const { return std::fabs(plain_gap(i)) <= 10.0 * (settings_.gap_zero + settings_.gap); }

  // The gap of a free foot. It grazes where it would dip below the ground by no more than some errors of a gap.
  Margin gap_margin(int i, const Row& shown) const {
    const double rate = dot(now_.mode->outputs + size_t(i) * sizes_.state(), rate_);
    const double curve = bend_of(i, step_.fraction) / (step_.length * step_.length);
    return {shown, rate, curve > 0.0 && 0.5 * rate * rate < GRAZE * settings_.gap * curve};
  }

  // What still holds a held foot: strength less smooth force less pull.
  Margin hold_margin(int i, const Row& shown) {
    const int ni = sizes_.inputs();
    double pulling = dot(now_.mode->outputs + size_t(i) * sizes_.state(), rate_);
    const Weights weights(nodes_, step_.fraction);
    for (int k : acting_) {
      const double v1 = weighted(weights.slope, value_.input(k)), v2 = weighted(weights.bend, value_.input(k));
      pulling += (v1 * now_.mode->feed[i * ni + k] + v2 * now_.mode->feed_rate[i * ni + k] / step_.length) / step_.length;
    }
    const int c = channel_of(i);
    const Jet at(now_.time.value), later = jet(at.value, Row(1.0)), volts = drive_at(c, at);
    const Row by = slope_of(holds(laws_, i, at - now_.since[i], volts, at)) - shown;
    const Jet age = jet(at.value - now_.since[i].value, Row(1.0));
    const Jet rising = jet(volts.value, slope_of(drive_at(c, later)) - slope_of(volts));
    const double rate = holds(fixed_laws_, i, age, rising, later).slope[0] - pulling;
    return {by, rate, std::fabs(rate) <= 1e-9 * run_.scales[1] / settings_.end};
  }

  // Pull that breaks the contact of a held foot off.
  static Jet holds(LawTangents& laws, int i, const Jet& age, const Jet& volts, const Jet& time) {
    Jet out(0.0);
    if (laws.has(i, HAS_LATCH)) out = laws.value(STRENGTH, i, {age});
    if (laws.has(i, HAS_FORCE)) out = out - laws.force(i, Jet(0.0), Jet(0.0), volts, time);
    return out;
  }

  // An event of the run. An impact that is the second of two at one moment has a moment of its own where
  // the two need not stay together and do not touch each other; where they do, there is no derivative.
  void apply(size_t event) {
    const Event& e = record_->events[event];
    const int foot = int(e.foot);
    const EventKind kind = EventKind(int(e.kind));
    const bool lands = kind == BOUNCE || kind == CAPTURE || kind == REST || kind == AVERAGED_CONTACT;
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
    const EventNumbers found = now_.apply(kind, foot, e.strength != 0.0);
    put(event, found);
    if (found.doubtful) flag(event, AT_THRESHOLD, -1);
    if (any_less(Row(0.0), magnitude(apart))) now_.shift_moment(-apart);
    if (lands) struck_.push_back(foot);
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
