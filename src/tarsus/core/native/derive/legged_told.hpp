// What is told of the lanes beside a legged robot's run: derivatives of events, marks and samples.
#pragma once
#include "derive/legged_lanes.hpp"

namespace tarsus::legged {

class LeggedTold : public LeggedLanes {
 public:
  using LeggedLanes::LeggedLanes;

 protected:
  void note_event(int i, int what, const Struck& numbers) {
    std::vector<Row>& to = slopes.events;
    to.insert(to.end(), {slope_of(numbers.when), Row(0.0), Row(0.0)});
    for (const Jet* one : {&numbers.before, &numbers.after, &numbers.pull, &numbers.strength, &numbers.energy, &numbers.adhesion}) {
      to.push_back(slope_of(*one));
    }
    to.push_back(lane_row([&](const Legged& t) { return t.feet[i].apex.gap; }));
    to.push_back(lane_row([&](const Legged& t) { return t.feet[i].apex.time; }));
    to.push_back(lane_row([&](const Legged& t) { return t.feet[i].apex.integral; }));
    if (what == SLIP_BEGINS || what == STICK_BEGINS) return;
    restart(i, slope_of(place_.time));
  }
  void restart(int i, const Row& when) {
    for (int lane = 0; lane < count_; lane++) {
      lanes_[lane].feet[i].apex.gap = 0.0;
      lanes_[lane].feet[i].apex.time = when[lane];
    }
  }

  // What is highest at the mark itself moves with it, and the integral goes up to it.
  void note_mark(int i, const Row& by, const Rates* rate, bool rising) {
    std::vector<Row>& to = slopes.events;
    const size_t first = to.size();
    to.resize(first + EVENT_WIDTH, Row(0.0));
    to[first] = by;
    to[first + 9] = lane_row([&](const Legged& t) { return t.feet[i].apex.gap; });
    to[first + 10] = rising ? by : lane_row([&](const Legged& t) { return t.feet[i].apex.time; });
    to[first + 11] = lane_row([&](const Legged& t) { return t.feet[i].apex.integral; });
    if (rate != nullptr) {
      if (rising) to[first + 9] += by * rate->u[DIRECTIONS * size_t(i) + UP];
      to[first + 11] += by * (feet[i].u[UP] + body.legs[i].gap);
    }
    restart(i, by);
  }

  void mark_lanes(const Row& by, const Rates* rate, bool low, bool high) {
    std::vector<Row>& to = slopes.marks;
    const auto moving = [&](const Row& found, double speed) { return rate != nullptr ? found + by * speed : found; };
    to.push_back(by);
    std::vector<Row> place;
    for (int b = 0; b < coordinates(); b++) {
      place.push_back(moving(lane_row([&](const Legged& t) { return t.x[b]; }), rate != nullptr ? rate->x[b] : 0.0));
    }
    to.insert(to.end(), place.begin(), place.end());
    for (int i : body.leg) {
      to.push_back(moving(lane_row([&](const Legged& t) { return t.feet[i].u[ALONG]; }),
                          rate != nullptr ? rate->u[DIRECTIONS * size_t(i) + ALONG] : 0.0));
    }
    for (int i : body.leg) {
      to.push_back(moving(lane_row([&](const Legged& t) { return t.feet[i].slipped; }), rate != nullptr ? rate->slipped[i] : 0.0));
    }
    to.push_back(low ? place[1] : lane_row([](const Legged& t) { return t.lowest_body; }));
    to.push_back(high ? place[1] : lane_row([](const Legged& t) { return t.highest_body; }));
    for (int lane = 0; lane < count_; lane++) lanes_[lane].lowest_body = lanes_[lane].highest_body = place[1][lane];
  }

  // At scaled time s of the step.
  void sample(double h, double s, double time) {
    Moment here;
    here.legs.resize(DIRECTIONS * body.legs.size());
    motion_at(*this, h, s, here);
    JetPlace to = place();
    to.time = Jet(time);
    const auto fill = [&](auto&& value) {
      for (int b = 0; b < coordinates(); b++) {
        value(to.x[b], here.x[b]);
        value(to.v[b], here.v[b]);
      }
      for (int i = 0; i < legs(); i++) {
        for (int d = 0; d < DIRECTIONS; d++) {
          value(to.of(to.u, i, d), here.of(i, d).u);
          value(to.of(to.w, i, d), here.of(i, d).w);
        }
      }
    };
    fill([](Jet& one, double value) { one = Jet(value); });
    for (int lane = 0; lane < count_; lane++) {
      lane_at(lane, h, s, here);
      fill([&](Jet& one, double value) { one.slope[lane] = value; });
    }
    note_sample(to);
  }

  void note_sample(JetPlace& to) {
    acting_.on(to);
    std::vector<Row>& out = slopes.samples;
    const auto leg_rate = [&](int i, int d) { return d == UP && feet[i].filmed() ? acting_.rate(i) : to.of(to.w, i, d); };
    for (const Jet& one : to.x) out.push_back(slope_of(one));
    for (int i = 0; i < legs(); i++) out.insert(out.end(), {slope_of(to.of(to.u, i, ALONG)), slope_of(to.of(to.u, i, UP))});
    for (const Jet& one : to.v) out.push_back(slope_of(one));
    for (int i = 0; i < legs(); i++) out.insert(out.end(), {slope_of(leg_rate(i, ALONG)), slope_of(leg_rate(i, UP))});
    std::vector<Row> resistive, smooth, pull;
    const size_t gaps = out.size();
    for (int i : body.leg) out.push_back(slope_of(to.of(to.u, i, UP) + acting_.gap(i)));
    for (int i : body.leg) out.push_back(slope_of(leg_rate(i, UP)));
    for (int i : body.leg) {
      const Jet gap = to.of(to.u, i, UP) + acting_.gap(i), rate = leg_rate(i, UP);
      const bool free = feet[i].contact == AIR;
      resistive.push_back(free && feet[i].film ? slope_of(laws_.momentum_slope(body.legs[i].foot, gap, settings.probe) * rate) : Row(0.0));
      smooth.push_back(free ? slope_of(acting_.smooth(i, gap, rate)) : Row(0.0));
      pull.push_back(free ? Row(0.0) : slope_of(structure_force(acting_, i, UP, -acting_.gap(i))));
      if (!free) out[gaps + body.legs[i].foot] = Row(0.0);
    }
    for (const auto* part : {&resistive, &smooth, &pull}) out.insert(out.end(), part->begin(), part->end());
  }
};

}  // namespace tarsus::legged
