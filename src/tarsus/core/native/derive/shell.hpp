// What is reported of the derivatives of a run, whatever the system: those of its events and marks; how their moments move; and
// where a derivative does not exist.
//
// The moment at which a function g of the state vanishes moves by dt = -dg / g'. A state is taken along with it, Dz = dz + z' dt,
// goes through the map of the event, and is dz = Dz - z' dt after it, z' being its rate then (saltation).
#pragma once
#include "derive/tangent.hpp"
#include "march/log.hpp"
#include "march/march.hpp"
#include "march/rules.hpp"
#include "record/replay.hpp"

namespace tarsus {

// A function of an event: its tangents at a fixed time, and its rate; grazes: it hardly passes zero.
struct Margin {
  Row by;
  double rate;
  bool grazes;
};

// Of the flight or contact that a foot is in: highest gap and when, and the integral of the gap since the start of the run.
struct FootTangent {
  Row apex = Row(0.0), apex_time = Row(0.0), integral = Row(0.0);
};

class EventShell {
 public:
  std::vector<Row> events;  // (events, EVENT_WIDTH)
  std::vector<TangentFlag> flags;
  std::vector<FootTangent> feet;
  Row shared = Row(0.0);     // derivative of the moment of the last event or moving kink,
  double shared_at = -INF;   // and that moment [s]
  bool by_kink = false;      // it is a kink's: a foot that lands there has a moment of its own

  // force [N]: the scale of a run; period: derivative [s] of the marks'.
  EventShell(const Settings& settings, int count, double force, const Row& period)
      : feet(count), settings_(settings), force_(force), period_(period) {}

  // From an event on there is no derivative.
  void flag(size_t event, Doubtful reason, int lane = -1) { flags.push_back({double(event), double(reason), double(lane)}); }

  // ---- moments

  // The moment of an event.
  void take_moment(size_t event, const Margin& found, double time) {
    shared = -found.by / found.rate;
    shared_at = time;
    by_kink = false;
    if (found.grazes) flag(event, GRAZING);
  }

  // A moment that does not move.
  void stay(double time) {
    shared = Row(0.0);
    shared_at = time;
    by_kink = false;
  }

  // A kink of a drive that moves by so much. False where that moves nothing.
  bool take_kink(size_t event, const Row& by, double time) {
    for (int lane = 0; lane < LANES && shared_at == time; lane++) {
      if (std::fabs(shared[lane] - by[lane]) > 1e-9 * std::fabs(by[lane])) flag(event, APART, lane);
    }
    shared = by;
    shared_at = time;
    by_kink = true;
    return any_less(Row(0.0), magnitude(by));
  }

  // Which end of a period a mark at a time is; 0 where it is that of the run.
  double turns_at(double time) const {
    const double turns = std::isfinite(settings_.period) ? std::round(time / settings_.period) : 0.0;
    const bool whole = std::fabs(time - turns * settings_.period) <= 1e-12 * time && time < settings_.end;
    return whole ? turns : 0.0;
  }
  Row mark_at(double time) const { return period_ * turns_at(time); }

  // Whether a gap that approaches zero would dip below it by no more than some errors; whether a force hardly passes zero.
  bool gap_grazes(double rate, double bend) const { return bend > 0.0 && 0.5 * rate * rate < room() * bend; }
  bool force_grazes(double rate) const { return !(std::fabs(rate) > 1e-9 * force_ / settings_.end); }
  double room() const { return GRAZE * settings_.gap; }

  // Whether a foot turns in a step, up to its scaled time ``end``, so close above the ground that an error of its gap could hide
  // a touchdown: exact(s) -> its gap, and the rate of that by s. Nodes are so dense that one of them sees a parabola's lowest
  // tenth. The polynomial through them determines only roughly where it turns: over several radians of a mode it is off by 2e-4 of
  // the way, and a turn that it puts lower than ROUGH of that is found from the motion itself.
  template <class Exact>
  bool nearly_lands(const Nodes& nodes, const Row& gaps, double end, Exact&& exact) const {
    constexpr double ROUGH = 1e-2;
    const double most = highest(gaps);
    if (gaps[0] <= room() || !any_less(gaps, Row(0.1 * most))) return false;
    alignas(64) double gap[N];
    store(gap, gaps);
    const int low = int(std::min_element(gap, gap + N) - gap);
    double s = nodes.tau[low], value = gap[low], bend = 0.0;
    const auto on = [&](double slope) {  // Newton's method for where it turns
      s -= slope / bend;
      return 0.0 < s && s < end;
    };
    for (int n = 0; n < 4; n++) {
      const modal::Weights at(nodes, s);
      bend = total(at.bend * gaps);
      value = total(at.value * gaps);
      if (!(bend > 0.0) || !on(total(at.slope * gaps))) return false;
    }
    if (value >= std::max(room(), ROUGH * most)) return false;
    for (int n = 0; n < 4; n++) {
      const auto [there, rate] = exact(s);
      value = there;
      if (!on(rate)) return false;
    }
    return value < room();
  }

  // ---- what is reported

  // An event of a foot, at a moment.
  void put(size_t event, int foot, const EventNumbers<Jet>& numbers) {
    Row* to = row(event);
    to[0] = slope_of(numbers.when);
    int n = 3;
    for (const Jet* one : {&numbers.before, &numbers.after, &numbers.pull, &numbers.strength, &numbers.energy, &numbers.adhesion}) {
      to[n++] = slope_of(*one);
    }
    put_flight(to, feet[foot]);
  }

  // A mark that moves by so much, at which a foot's gap has a rate. What is highest at the mark itself (``rising``) moves with
  // it, and the integral goes up to it.
  void put_mark(size_t event, int foot, const Row& by, double gap, double rate, bool rising) {
    Row* to = row(event);
    to[0] = by;
    put_flight(to, feet[foot]);
    if (rising) {
      to[9] += by * rate;
      to[10] = by;
    }
    to[11] += by * gap;
    restart(foot, by);
  }

  // A flight or a contact of a foot begins.
  void restart(int foot, const Row& when) {
    feet[foot].apex = Row(0.0);
    feet[foot].apex_time = when;
  }

 private:
  static constexpr double GRAZE = 100.0;  // errors of a gap, within which a foot may touch the ground or not
  const Settings& settings_;
  double force_;
  Row period_;

  Row* row(size_t event) {
    if (events.size() < (event + 1) * EVENT_WIDTH) events.resize((event + 1) * EVENT_WIDTH, Row(0.0));
    return &events[event * EVENT_WIDTH];
  }
  static void put_flight(Row* to, const FootTangent& foot) {
    to[9] = foot.apex;
    to[10] = foot.apex_time;
    to[11] = foot.integral;
  }
};

}  // namespace tarsus
