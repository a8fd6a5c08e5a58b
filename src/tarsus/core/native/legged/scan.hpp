// The first events inside a step whose nodes are known.
#pragma once
#include "legged/motion.hpp"
#include "legged/profile.hpp"
#include "legged/slip.hpp"

namespace tarsus::legged {

// Of uneven ground too: a foot comes to an end of its facet, on it or above it; one that stands in a corner is pulled off its own
// facet while it is pressed against the next, or is pressed against that no more. A foot slips up or down the way, or any way.
enum FootEvent { NOTHING, TOUCH, PULL_OFF, SLIP_UP, SLIP_DOWN, STOP, HIGH_END, LOW_END, SHIFT, LOOSE, SLIP };

// Where a foot may have an event, in scaled time; in the end low = high is its time.
struct Bracket {
  double low, high;
  FootEvent kind;
};

struct Candidates {
  int count = 0;
  Bracket some[2 + DIRECTIONS];  // of a foot on the ground: pulled off, slips or stops, and one for each end of its facet

  void note(double low, double high, FootEvent kind, double limit) {
    if (low < limit) some[count++] = {low, high, kind};
  }
};

// The polynomial through nodal values at one of the places between every two nodes.
inline Row between_nodes(const Legged& s, const Row& values, int line) {
  Row points = load(&s.between.dense[0][line * N]) * values[0];
  for (int j = 1; j < N; j++) points += load(&s.between.dense[j][line * N]) * values[j];
  return points;
}

// Note where what has those values at the nodes, and ``at(line)`` between them, first falls below ``level``.
template <class At>
inline void falls_below(const Legged& s, const Row& values, double level, double limit, FootEvent kind, Candidates& out, At&& at) {
  if (values[0] < level) return out.note(0.0, 0.0, kind, 1.0);
  const double least = lowest(values), most = highest(values);
  if (least - 0.5 * (most - least) > level) return;
  double begin = 0.0, end = 2.0;
  for (int j = 1; j < N; j++) {
    if (values[j] < level) {
      begin = s.nodes.tau[j - 1];
      end = s.nodes.tau[j];
      break;
    }
  }
  for (int line = 0; line < Between::LINES; line++) {
    const Row points = at(line);
    if (lowest(points) >= level) continue;
    for (int n = 0; n < N; n++) {
      const int p = line * N + n;
      const double place = s.between.places[p];
      if (!(points[n] < level && place < end)) continue;
      end = place;
      begin = p > 0 ? s.between.places[p - 1] : 0.0;
      for (int j = 0; j < N; j++) {
        if (begin < s.nodes.tau[j] && s.nodes.tau[j] < place) begin = s.nodes.tau[j];
      }
    }
  }
  if (end < 2.0) out.note(begin, end, kind, limit);
}
inline void falls_below(const Legged& s, const Row& values, double level, double limit, FootEvent kind, Candidates& out) {
  falls_below(s, values, level, limit, kind, out, [&](int line) { return between_nodes(s, values, line); });
}

// A polynomial through nodal values, and its derivative by the scaled time.
struct Polynomial {
  double line[N];

  Polynomial(const Legged& s, const Row& values) { store(line, s.powers(values)); }
  double value(double place) const { return horner(line, 0, N, place); }
  double slope(double place) const {
    double sum = 0.0;
    for (int c = N - 1; c > 0; c--) sum = sum * place + c * line[c];
    return sum;
  }
};

// What friction can bear under a foot beyond what it has to bear along and across the way together.
struct Room {
  Polynomial bound, along, across;

  Room(const Legged& s, int i) : bound(s, s.rows[i].bound), along(s, s.rows[i].force[ALONG]), across(s, s.rows[i].force[ACROSS]) {}
  double value(double place) const { return bound.value(place) - std::hypot(along.value(place), across.value(place)); }
  double slope(double place) const {
    const double a = along.value(place), b = across.value(place), size = std::hypot(a, b);
    return bound.slope(place) - (size > 0.0 ? (a * along.slope(place) + b * across.slope(place)) / size : 0.0);
  }
};

// Note where a function dips below ``level`` between the places at which `falls_below` looks: at the least
// value next to the least of SAMPLES. Only what goes by the square of volts that pass through zero is so narrow.
template <class Function>
TARSUS_APART inline void dips_below(const Function& function, double level, double limit, FootEvent kind, Candidates& out) {
  constexpr int SAMPLES = 32;
  double least = INF;
  int at = 0;
  for (int n = 0; n <= SAMPLES; n++) {
    const double value = function.value(double(n) / SAMPLES);
    if (value >= least) continue;
    least = value;
    at = n;
  }
  const double begin = std::max(at - 1, 0) / double(SAMPLES);
  double low = begin, high = std::min(at + 1, SAMPLES) / double(SAMPLES);
  for (int n = 0; n < 50 && high - low > 1e-15; n++) {
    const double middle = 0.5 * (low + high);
    (function.slope(middle) < 0.0 ? low : high) = middle;
  }
  if (function.value(high) < level && function.value(begin) >= level) out.note(begin, high, kind, limit);
}

// Gap and scaled time of the lowest point of a flight between nodes j - 1 and j, where its rate changes sign; share: of the
// interval, to which the time is found. A gap needs no more than half of the digits, for it is level there.
struct Lowest {
  double gap, at;
};

template <class Flight>
TARSUS_APART Lowest lowest_between(const Legged& s, int j, Flight&& gap_at, double share = 1e-6) {
  double low = s.nodes.tau[j - 1], high = s.nodes.tau[j];
  const double enough = share * (high - low);
  double at = 0.5 * (low + high), gap = 0.0;
  for (int n = 0; n < 60; n++) {
    const Motion now = gap_at(at);
    gap = now.u;
    (now.w < 0.0 ? low : high) = at;
    if (high - low < enough) break;
    at = 0.5 * (low + high);
  }
  return {gap, at};
}

// Note where a distance [m], at the nodes with its rate, first falls below zero; at: both by the scaled time; none: what is no distance.
template <class Flight>
void runs_out(const Legged& s, const Row& gap, const Row& rate, double none, double h, double limit, FootEvent kind, Candidates& out, Flight&& at) {
  const double* tau = s.nodes.tau;
  // two neighbouring nodes are less than a quarter of a step apart, in which no flight falls farther than this
  if (lowest(gap) > 0.25 * h * highest(magnitude(rate))) return;
  for (int j = 1; j < N && tau[j - 1] < limit; j++) {
    if (gap[j] < -none) return out.note(tau[j - 1], tau[j], kind, limit);
    if (!(rate[j - 1] < 0.0 && 0.0 < rate[j])) continue;
    // the parabola of the two rates bounds how far below its ends the flight may dip
    const double width = (tau[j] - tau[j - 1]) * h;
    const double drop = 0.5 * width * rate[j - 1] * rate[j - 1] / (rate[j] - rate[j - 1]);
    if (std::min(gap[j - 1], gap[j]) >= 2.0 * drop) continue;
    const Lowest least = lowest_between(s, j, at);
    if (least.gap < -none) return out.note(tau[j - 1], least.at, kind, limit);
  }
}

// Note where a free foot first reaches the ground; gap_at: its gap [m] and what has the sign of its rate, by the scaled time.
template <class Flight>
void touches(const Legged& s, int i, double h, double limit, Candidates& out, Flight&& gap_at) {
  const LegRows& r = s.rows[i];
  const double none = s.settings.gap_zero + s.body.legs[i].rounding;
  if (s.feet[i].start == AS_IT_COMES && r.gap[0] <= none && r.rate[0] <= s.settings.speed_zero) {
    return out.note(0.0, 0.0, TOUCH, 1.0);
  }
  runs_out(s, r.gap, r.rate, none, h, limit, TOUCH, out, gap_at);
}

// Distance [m] of a foot from an end of its facet, way = 1 the upper one, and its rate [m/s], at scaled time ``fraction``.
inline Motion left_at(const Legged& s, int i, int way, double h, double fraction) {
  const Leg& leg = s.body.legs[i];
  const Motion at = foot_at(s, i, ALONG, h, fraction);
  const double place = at.u + leg.place;
  return {way * (end_of(s, i, way) - place), -way * at.w};
}

// Note where a foot that moves along the ground first comes to an end of its facet.
inline void comes_to_end(const Legged& s, int i, double h, double limit, Candidates& out) {
  const Leg& leg = s.body.legs[i];
  const LegRows& r = s.rows[i];
  Row rate = r.w[ALONG];
  if (const double share = s.film_share(i, ALONG)) rate += r.film * (share / leg.mass);
  for (int way : {1, -1}) {
    const Row left = (end_of(s, i, way) - leg.place - r.u[ALONG]) * double(way);
    const FootEvent kind = way > 0 ? HIGH_END : LOW_END;
    if (!std::isfinite(left[0])) continue;
    if (left[0] <= leg.rounding && way * rate[0] > s.settings.speed_zero) {
      out.note(0.0, 0.0, kind, 1.0);
      continue;
    }
    runs_out(s, left, rate * double(-way), leg.rounding, h, limit, kind, out, [&](double at) { return left_at(s, i, way, h, at); });
  }
}

// Of a foot that stands in a corner, at the nodes: its margin on its own facet, where the next one bears what it is pressed along by. On a ridge
// what drives it back from the next facet (see OnRidge), over the corner's sine.
inline Row wedged_margin(const Legged& s, int i) {
  const Corner corner = corner_of(s, i, s.feet[i].wedged);
  const Row margin = s.rows[i].margin - s.rows[i].force[ALONG] * (s.feet[i].wedged * corner.cos / corner.sin);
  return corner.rises() ? margin : s.rows[i].smooth - margin;
}

// The margin of a foot on the ground; on a ridge that of the two facets which holds it longer.
inline Row margin_of(const Legged& s, int i) {
  const LegRows& r = s.rows[i];
  if (s.feet[i].wedged == 0) return r.margin;
  const Corner corner = corner_of(s, i, s.feet[i].wedged);
  const Row next = r.smooth - ((r.smooth - r.margin) * corner.cos - r.force[ALONG] * (s.feet[i].wedged * corner.sin));
  return next[N - 1] > r.margin[N - 1] ? next : r.margin;
}

// Note where a foot that slides any way first comes to a stop; rounding is no speed.
inline void stops_any_way(const Legged& s, int i, double h, double limit, Candidates& out) {
  const double soon = s.feet[i].just_slides() ? -1.0 : hardly_slides(s, i, h);
  if (soon >= 0.0) return out.note(soon, soon, STOP, limit);
  falls_below(s, Stopping(s, i, limit).at_nodes(s, i, h), -s.settings.speed_zero, limit, STOP, out);
}

// Note where a foot that slides along the way first comes to a stop.
inline void stops(const Legged& s, int i, double limit, Candidates& out) {
  const double sense = s.feet[i].sense[ALONG];
  if (sense == 0.0) return;
  const Row& w = s.rows[i].w[ALONG];
  if (!s.feet[i].just_slides() && sense * w[0] <= 0.0) return out.note(0.0, 0.0, STOP, 1.0);
  for (int j = 1; j < N && s.nodes.tau[j - 1] < limit; j++) {
    if (sense * w[j] < 0.0) return out.note(s.nodes.tau[j - 1], s.nodes.tau[j], STOP, limit);
  }
}

// Note where a foot that sticks first slips any way.
inline void slips_any_way(const Legged& s, int i, double limit, Candidates& out) {
  const LegRows& r = s.rows[i];
  const auto room = [](const Row& bound, const Row& along, const Row& across) {
    return bound - each(along, across, [](double a, double b) { return std::hypot(a, b); });
  };
  const double level = -s.settings.force_zero;
  const int known = out.count;
  falls_below(s, room(r.bound, r.force[ALONG], r.force[ACROSS]), level, limit, SLIP, out, [&](int line) {
    return room(between_nodes(s, r.bound, line), between_nodes(s, r.force[ALONG], line), between_nodes(s, r.force[ACROSS], line));
  });
  if (s.laws.commanded() && out.count == known) dips_below(Room(s, i), level, limit, SLIP, out);
}

// The candidates for the first event of a foot; gap_at: see ``touches``.
template <class Flight>
Candidates candidates(Legged& s, int i, double h, double limit, Flight&& gap_at) {
  Candidates out;
  const LeggedFoot& foot = s.feet[i];
  if (foot.contact == AIR) {
    touches(s, i, h, limit, out, gap_at);
    if (s.profile != nullptr) comes_to_end(s, i, h, limit, out);
    return out;
  }
  LegRows& r = s.rows[i];
  const double level = -s.settings.force_zero;
  if (foot.wedged != 0) {
    falls_below(s, wedged_margin(s, i), level, limit, SHIFT, out);
    falls_below(s, r.force[ALONG] * double(foot.wedged), level, limit, LOOSE, out);
    if (!corner_of(s, i, foot.wedged).rises()) falls_below(s, margin_of(s, i), level, limit, PULL_OFF, out);
    return out;
  }
  const bool commanded = s.laws.commanded();
  const auto look = [&](const Row& margin, FootEvent kind) {
    const int known = out.count;
    falls_below(s, margin, level, limit, kind, out);
    if (commanded && out.count == known) dips_below(Polynomial(s, margin), level, limit, kind, out);
  };
  look(r.margin, PULL_OFF);
  if (foot.contact == SLIPPING) {
    s.any_way(i) ? stops_any_way(s, i, h, limit, out) : stops(s, i, limit, out);
  } else {
    r.bound = s.laws.friction(s.body.legs[i].foot, r.margin, r.strength, Row(0.0));
    if (s.directions() > DIRECTIONS) {
      slips_any_way(s, i, limit, out);
    } else {
      look(r.bound - r.force[ALONG], SLIP_UP);
      look(r.bound + r.force[ALONG], SLIP_DOWN);
    }
  }
  if (s.profile != nullptr && foot.contact == SLIPPING) comes_to_end(s, i, h, limit, out);
  return out;
}

// The event function of a foot, positive before its event, and its slope by the scaled time where that is known.
struct EventFunction {
  const Legged& s;
  const int i;
  const FootEvent kind;
  const double h;
  double powers[N];

  EventFunction(const Legged& state, int leg, const Bracket& found, double step)
      : s(state), i(leg), kind(found.kind), h(step) {
    const LegRows& r = s.rows[i];
    if (kind == STOP && s.any_way(i)) store(powers, s.powers(Stopping(s, i, found.high).at_nodes(s, i, h)));
    if (moves() || kind == SLIP) return;
    store(powers, s.powers(kind == PULL_OFF  ? margin_of(s, i)
                           : kind == SHIFT   ? wedged_margin(s, i)
                           : kind == LOOSE   ? r.force[ALONG] * double(s.feet[i].wedged)
                           : kind == SLIP_UP ? r.bound - r.force[ALONG]
                                             : r.bound + r.force[ALONG]));
  }
  // Whether it is of the foot's own motion, which may start from an exact zero.
  bool moves() const { return kind == TOUCH || kind == STOP || kind == HIGH_END || kind == LOW_END; }
  bool starts_from_zero() const { return kind == STOP ? s.feet[i].just_slides() : s.feet[i].start != AS_IT_COMES; }
  double at(double fraction, double& slope) const {
    if (kind == HIGH_END || kind == LOW_END) {
      const Motion now = left_at(s, i, kind == HIGH_END ? 1 : -1, h, fraction);
      slope = now.w * h;
      return now.u;
    }
    if (kind == TOUCH) {
      const Motion now = gap_at(s, i, h, fraction);
      slope = now.w * h;
      return now.u;
    }
    if (kind == STOP && s.any_way(i)) return horner(powers, 0, N, fraction);
    if (kind == STOP) return s.feet[i].sense[ALONG] * leg_at(s, i, ALONG, h, fraction).w;
    if (kind == SLIP) return Room(s, i).value(fraction) + s.settings.force_zero;
    return horner(powers, 0, N, fraction) + s.settings.force_zero;
  }
};

// Scaled time of the event of a foot in a bracket, to rounding.
template <class Function>
TARSUS_APART double refine(const Legged& s, int i, const Bracket& bracket, Function& function) {
  double low = bracket.low, high = bracket.high, slope = 0.0;
  if (low == 0.0 && (function.starts_from_zero() || s.body.legs[i].rounding > 0.0) && function.moves()) {
    low = high;  // it starts from an exact zero: find a place after it at which the event is still to come
    for (int n = 0; n < 50; n++) {
      low *= 0.5;
      if (function.at(low, slope) > 0.0) break;
      high = low;
    }
  }
  double at = 0.5 * (low + high), below = 0.0, above = 0.0;  // values at the ends once known, for the secant
  bool known_below = false, known_above = false;
  for (int n = 0; n < 100; n++) {
    slope = 0.0;
    const double value = function.at(at, slope);
    if (value >= 0.0) {
      low = at;
      below = value;
      known_below = true;
    } else {
      high = at;
      above = value;
      known_above = true;
    }
    if (high - low <= 4e-16 * high || value == 0.0) break;
    double next = 0.5 * (low + high);
    if (slope < 0.0) {
      next = at - value / slope;
    } else if (known_below && known_above) {
      next = low + (high - low) * below / (below - above);
    }
    if (std::fabs(next - at) < 1e-16 * at) break;
    if (!(low < next && next < high) || n % 6 == 5) next = 0.5 * (low + high);
    at = next;
  }
  return at;
}

// Whether there is no force along the ground by which the foot could slip: the bound passes 0 because the foot is about to leave. Where it is
// zero all the time, the foot slips as soon as any force grows.
inline bool nothing_along(const Legged& s, int i, double fraction) {
  bool out = highest(magnitude(s.rows[i].bound)) > 0.0;
  in_directions<ALONG>(s, [&](auto d) { out = out && std::fabs(s.polynomial_at(s.rows[i].force[d], fraction)) <= s.settings.force_zero; });
  return out;
}

// The first event of a foot, at its own time (2: none).
inline Bracket first_of_foot(Legged& s, int i, double h, double limit) {
  const Candidates found = candidates(s, i, h, limit, [&](double at) { return gap_at(s, i, h, at); });
  Bracket best = {2.0, 2.0, NOTHING};
  for (int n = 0; n < found.count; n++) {
    const Bracket& one = found.some[n];
    if (one.low > std::min(best.low, limit)) continue;
    EventFunction function(s, i, one, h);
    const double at = one.high <= 0.0 ? 0.0 : refine(s, i, one, function);
    if (at > limit || at >= best.low) continue;
    if ((one.kind == SLIP_UP || one.kind == SLIP_DOWN || one.kind == SLIP) && nothing_along(s, i, at)) continue;
    best = {at, at, one.kind};
  }
  return best;
}

}  // namespace tarsus::legged
