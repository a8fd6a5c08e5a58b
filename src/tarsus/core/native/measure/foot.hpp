// What one foot did in a run: its flights, impacts, highest gaps and the integral of its gap, by its events; which flights are seen.
//
// tarsus/measure/history.py says what each is, and hands them over; its definitions are carried out here alone.
#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "march/kinds.hpp"

namespace tarsus::measure {

// An event as measures see it; see tarsus::Event.
struct Happening {
  double time, kind, speed, apex, apex_time, integral;
};

struct Flight {
  double start, end, apex, apex_time;
  bool rebound;
};

struct Point {
  double time, value;
};

struct Stay {
  double start, end;
};

// Flights that clear ``height`` [m] are seen, and those after contacts shorter than ``dwell`` [s] are bounces.
struct Counting {
  double height, dwell;
};

inline bool is_impact(int kind) { return kind == BOUNCE || kind == CAPTURE || kind == REST || kind == AVERAGED_CONTACT; }

struct Foot {
  std::vector<Flight> flights;
  std::vector<Point> impacts, tops, knots;  // approach speeds [m/s], highest gaps [m], integrals of the gap [m s]
  double until = 0.0;                       // [s] end of the history
  bool airborne = true, aloft = false;      // the first flight began with the run; the last one was cut off by the end

  Foot() = default;

  // Of its events in the order in which the engine met them. A rest bears the time at which its accumulation ends, but comes at the
  // latest with the next event.
  Foot(std::vector<Happening> events, double end) : until(end) {
    for (size_t k = events.size(); k-- > 1;) events[k - 1].time = std::min(events[k - 1].time, events[k].time);
    for (const Happening& event : events) {
      const int kind = int(event.kind);
      if (!is_impact(kind) && kind != CONTACT_AT_START && kind != RELEASE) continue;
      airborne = kind != CONTACT_AT_START && kind != RELEASE;
      break;
    }
    if (airborne) flights.push_back({0.0, until, 0.0, 0.0, false});
    bool ended = false;
    for (const Happening& event : events) {
      const int kind = int(event.kind);
      const bool contact = is_impact(kind) || kind == CONTACT_AT_START;
      if (!flights.empty() && (contact || kind == PERIOD_MARK)) {
        Flight& last = flights.back();
        if (event.apex > 0.0 && event.apex >= last.apex) {
          last.apex = event.apex;
          last.apex_time = event.apex_time;
        }
        if (contact) last.end = event.time;
      }
      ended = ended || contact;
      if (kind == BOUNCE || kind == RELEASE) {
        flights.push_back({event.time, until, 0.0, event.time, kind == BOUNCE});
        ended = false;
      }
      if (is_impact(kind)) impacts.push_back({event.time, event.speed});
      if (event.apex > 0.0) tops.push_back({event.apex_time, event.apex});
    }
    aloft = !flights.empty() && !ended;
    knots.push_back({0.0, 0.0});
    for (const Happening& event : events) knots.push_back({event.time, event.integral});
    if (!aloft) knots.push_back({until, knots.back().value});
  }

  // Numbers of the flights that leave the ground for an instrument. What is between two of them is one contact.
  std::vector<int64_t> seen(double height) const {
    std::vector<int64_t> out;
    for (size_t k = 0; k < flights.size(); k++) {
      if (flights[k].apex > height || (k == 0 && airborne)) out.push_back(int64_t(k));
    }
    return out;
  }

  // Those that began from the ground.
  std::vector<int64_t> hops(double height) const {
    std::vector<int64_t> out = seen(height);
    if (airborne && !out.empty()) out.erase(out.begin());
    return out;
  }

  std::vector<int64_t> bounces(const Counting& counting) const {
    const std::vector<int64_t> found = seen(counting.height);
    std::vector<int64_t> out;
    for (size_t k = 1; k < found.size(); k++) {
      if (flights[found[k]].start - flights[found[k - 1]].end < counting.dwell) out.push_back(found[k]);
    }
    return out;
  }

  std::vector<int64_t> rebounds(double height) const {
    std::vector<int64_t> out;
    for (size_t k = 0; k < flights.size(); k++) {
      if (flights[k].rebound && flights[k].apex > height) out.push_back(int64_t(k));
    }
    return out;
  }

  // Stays on the ground, flights below ``height`` included, in time order.
  std::vector<Stay> contacts(double height) const {
    const std::vector<int64_t> found = seen(height);
    std::vector<Stay> out;
    if (!airborne) out.push_back({0.0, found.empty() ? until : flights[found[0]].start});
    for (size_t k = 1; k < found.size(); k++) out.push_back({flights[found[k - 1]].end, flights[found[k]].start});
    if (!found.empty() && !(aloft && size_t(found.back()) + 1 == flights.size())) out.push_back({flights[found.back()].end, until});
    return out;
  }

  // The knot before a time, the part of the way to the next one that has passed, and whether that is a whole flight from touchdown to
  // touchdown. There are two knots at least.
  struct Share {
    size_t at;
    double part;
    bool whole;
  };
  Share share(double time) const {
    const auto later = std::upper_bound(knots.begin(), knots.end(), time, [](double t, const Point& knot) { return t < knot.time; });
    const size_t at = size_t(std::clamp<int64_t>(later - knots.begin() - 1, 0, int64_t(knots.size()) - 2));
    const double begin = knots[at].time, length = knots[at + 1].time - begin;
    bool whole = false;
    if (!flights.empty()) {
      const auto next = std::upper_bound(flights.begin(), flights.end(), begin, [](double t, const Flight& one) { return t < one.start; });
      const size_t flight = size_t(std::max<int64_t>(next - flights.begin() - 1, 0));
      whole = flights[flight].start == begin && flights[flight].end == knots[at + 1].time && (flight > 0 || !airborne);
    }
    return {at, std::clamp(length > 0.0 ? (time - begin) / length : 1.0, 0.0, 1.0), whole};
  }

  // Integral of the gap from 0 to a time; NaN after the last known one. Exact at knots; inside a flight it is shared out as by a
  // parabola from touchdown to touchdown.
  double integral_at(double time) const {
    if (knots.size() < 2 || time > knots.back().time * (1.0 + 1e-8)) return std::nan("");
    const auto [at, part, whole] = share(time);
    const double s = whole ? part * part * (3.0 - 2.0 * part) : part;
    return knots[at].value + s * (knots[at + 1].value - knots[at].value);
  }
};

}  // namespace tarsus::measure
