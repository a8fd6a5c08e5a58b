// Measures from Python: of many feet at once, their arrays laid end to end. "own" is the number of a foot's history, "first" where
// each one's entries begin, and where the last one's end.
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include "base/convert.hpp"
#include "measure/moments.hpp"
#include "measure/walk.hpp"

namespace tarsus {

using namespace measure;

namespace {

typedef std::vector<int64_t> Numbers;

struct Histories {
  std::vector<Foot> feet;

  size_t check(size_t given) const {
    if (given != feet.size()) throw std::invalid_argument("of every history there is one");
    return given;
  }
  // Calls ``each(number, foot, index of its first flight)``.
  template <class Each>
  void every(Each&& each) const {
    int64_t first = 0;
    for (size_t h = 0; h < feet.size(); h++) {
      each(h, feet[h], first);
      first += int64_t(feet[h].flights.size());
    }
  }
};

// Events (time, foot, kind, approach speed, apex, its time, integral of the gap) of runs; place: of a foot's history in a run, or -1.
Histories of_events(const std::vector<Doubles>& columns, const Integers& first, const Doubles& ends, const Integers& place, size_t many) {
  const size_t runs = ends.size();
  Histories out;
  if (columns.size() != 7 || first.size() != runs + 1) throw std::invalid_argument("the sizes of events and runs differ");
  std::vector<std::vector<Happening>> events(many);
  for (size_t r = 0; r < runs; r++) {
    for (auto& one : events) one.clear();
    for (int64_t k = first.data()[r]; k < first.data()[r + 1]; k++) {
      const auto at = [&](int column) { return columns[column].data()[k]; };
      const int64_t to = place.data()[size_t(at(1))];
      if (to >= 0) events[to].push_back({at(0), at(2), at(3), at(4), at(5), at(6)});
    }
    for (size_t f = 0; f < many; f++) out.feet.emplace_back(events[f], ends.data()[r]);
  }
  return out;
}

std::vector<Point> points_of(const Numbers& at, const Doubles& time, const Doubles& value) {
  std::vector<Point> out;
  for (int64_t k : at) out.push_back({time.data()[k], value.data()[k]});
  return out;
}

Numbers of_history(const Integers& own, int64_t h) {
  Numbers out;
  for (size_t k = 0; k < own.size(); k++) {
    if (own.data()[k] == h) out.push_back(int64_t(k));
  }
  return out;
}

Numbers between(const Integers& first, size_t h) {
  Numbers out;
  for (int64_t k = first.data()[h]; k < first.data()[h + 1]; k++) out.push_back(k);
  return out;
}

// Of flights, impacts, tops and knots that are known: objects of tarsus.measure.history.
Histories known(nb::handle flights, nb::handle impacts, nb::handle tops, nb::handle knots) {
  const auto doubles = [](nb::handle of, const char* name) { return nb::cast<Doubles>(of.attr(name)); };
  const auto integers = [](nb::handle of, const char* name) { return nb::cast<Integers>(of.attr(name)); };
  const Integers first = integers(flights, "first"), hit = integers(impacts, "own"), up = integers(tops, "own"), knot = integers(knots, "first");
  const Doubles start = doubles(flights, "start"), end = doubles(flights, "end"), apex = doubles(flights, "apex"), when = doubles(flights, "apex_time");
  const Doubles until = doubles(flights, "until");
  const auto rebound = booleans(flights, "rebound"), airborne = booleans(flights, "airborne"), aloft = booleans(flights, "aloft");
  Histories out;
  for (size_t h = 0; h < until.size(); h++) {
    Foot foot;
    for (int64_t k : between(first, h)) foot.flights.push_back({start.data()[k], end.data()[k], apex.data()[k], when.data()[k], rebound[k] != 0});
    foot.impacts = points_of(of_history(hit, int64_t(h)), doubles(impacts, "time"), doubles(impacts, "value"));
    foot.tops = points_of(of_history(up, int64_t(h)), doubles(tops, "time"), doubles(tops, "value"));
    foot.knots = points_of(between(knot, h), doubles(knots, "time"), doubles(knots, "integral"));
    foot.until = until.data()[h];
    foot.airborne = airborne[h] != 0;
    foot.aloft = aloft[h] != 0;
    out.feet.push_back(std::move(foot));
  }
  return out;
}

// first, start, end, apex, apex_time, rebound, until, airborne, aloft: see tarsus.measure.history.Flights.
nb::tuple flights_of(const Histories& of) {
  Numbers first = {0};
  Values start, end, apex, when, until;
  std::vector<uint8_t> rebound, airborne, aloft;
  for (const Foot& foot : of.feet) {
    for (const Flight& one : foot.flights) {
      start.push_back(one.start);
      end.push_back(one.end);
      apex.push_back(one.apex);
      when.push_back(one.apex_time);
      rebound.push_back(one.rebound);
    }
    first.push_back(int64_t(start.size()));
    until.push_back(foot.until);
    airborne.push_back(foot.airborne);
    aloft.push_back(foot.aloft);
  }
  return nb::make_tuple(returned(std::move(first)), returned(std::move(start)), returned(std::move(end)), returned(std::move(apex)),
                        returned(std::move(when)), returned(std::move(rebound)), returned(std::move(until)), returned(std::move(airborne)),
                        returned(std::move(aloft)));
}

// own, time, value.
nb::tuple points(const Histories& of, std::vector<Point> Foot::*part) {
  Numbers own;
  Values time, value;
  for (size_t h = 0; h < of.feet.size(); h++) {
    for (const Point& point : of.feet[h].*part) {
      own.push_back(int64_t(h));
      time.push_back(point.time);
      value.push_back(point.value);
    }
  }
  return nb::make_tuple(returned(std::move(own)), returned(std::move(time)), returned(std::move(value)));
}

// Numbers of flights, counted through all histories.
template <class Of>
nb::object numbers(const Histories& of, Of&& chosen) {
  Numbers out;
  of.every([&](size_t h, const Foot& foot, int64_t first) {
    for (int64_t k : chosen(foot, h)) out.push_back(first + k);
  });
  return returned(std::move(out));
}

nb::tuple contacts(const Histories& of, double height) {
  Numbers own;
  Values start, end;
  for (size_t h = 0; h < of.feet.size(); h++) {
    for (const Stay& stay : of.feet[h].contacts(height)) {
      own.push_back(int64_t(h));
      start.push_back(stay.start);
      end.push_back(stay.end);
    }
  }
  return nb::make_tuple(returned(std::move(own)), returned(std::move(start)), returned(std::move(end)));
}

// Of histories ``own`` at times: the knot before, counted through all histories, the part of the way to the next one, and whether that is
// a whole flight.
nb::tuple shares(const Histories& of, const Integers& own, const Doubles& times) {
  Numbers first = {0}, at;
  for (const Foot& foot : of.feet) first.push_back(first.back() + int64_t(foot.knots.size()));
  Values part;
  std::vector<uint8_t> whole;
  for (size_t k = 0; k < own.size(); k++) {
    const int64_t h = own.data()[k];
    const Foot::Share found = of.feet.at(h).share(times.data()[k]);
    at.push_back(first[h] + int64_t(found.at));
    part.push_back(found.part);
    whole.push_back(found.whole);
  }
  return nb::make_tuple(returned(std::move(at)), returned(std::move(part)), returned(std::move(whole)));
}

Values edges_between(const Doubles& edges, const Integers& first, size_t h) {
  return Values(edges.data() + first.data()[h], edges.data() + first.data()[h + 1]);
}

template <class Table>
size_t find(const Table& table, const std::string& name) {
  for (size_t k = 0; k < table.size(); k++) {
    if (name == table[k].name) return k;
  }
  throw std::invalid_argument("there is no measure " + name);
}

template <class Table>
nb::object names_of(const Table& table) {
  nb::list out;
  for (const auto& one : table) out.append(one.name);
  return nb::tuple(out);
}

// Values of a measure in all windows of all histories.
nb::object in_windows(const Histories& of, const std::string& name, const Doubles& edges, const Integers& first, double height, const Doubles& dwell) {
  const auto measure = PER_WINDOW[find(PER_WINDOW, name)].of;
  of.check(dwell.size());
  Values out;
  for (size_t h = 0; h < of.feet.size(); h++) {
    const Values own = edges_between(edges, first, h), found = (Windows(of.feet[h], own, {height, dwell.data()[h]}).*measure)();
    out.insert(out.end(), found.begin(), found.end());
  }
  return returned(std::move(out));
}

nb::object in_whole_run(const Histories& of, const std::string& name, double height, const Doubles& dwell) {
  const auto measure = WHOLE_RUN[find(WHOLE_RUN, name)].of;
  of.check(dwell.size());
  Values out;
  for (size_t h = 0; h < of.feet.size(); h++) out.push_back(measure(of.feet[h], {height, dwell.data()[h]}));
  return returned(std::move(out));
}

// Of times of histories ``own``, the number of the last edge before, or of the window, counted through all of them, -1 where none is.
nb::object edge_numbers(const Doubles& edges, const Integers& first, const Integers& own, const Doubles& times) {
  Numbers out;
  for (size_t k = 0; k < own.size(); k++) {
    const double *from = edges.data() + first.data()[own.data()[k]], *to = edges.data() + first.data()[own.data()[k] + 1];
    out.push_back(std::upper_bound(from, to, times.data()[k]) - from - 1);
  }
  return returned(std::move(out));
}
nb::object window_numbers(const Doubles& edges, const Integers& first, const Integers& own, const Doubles& times, bool ended) {
  Numbers out;
  Values kept;
  int64_t last = -1;
  for (size_t k = 0; k < own.size(); k++) {
    const int64_t h = own.data()[k];
    if (h != last) kept = edges_between(edges, first, size_t(last = h));
    const int64_t found = window_of(kept, times.data()[k], ended);
    out.push_back(found >= 0 && found + 1 < int64_t(kept.size()) ? first.data()[h] - h + found : -1);
  }
  return returned(std::move(out));
}

nb::tuple periods_used(const Doubles& reached, const Doubles& period, const Integers& skip) {
  Numbers dropped, count;
  for (size_t r = 0; r < reached.size(); r++) {
    const Used found = used(reached.data()[r], period.data()[r], skip.data()[r]);
    dropped.push_back(found.dropped);
    count.push_back(found.count);
  }
  return nb::make_tuple(returned(std::move(dropped)), returned(std::move(count)));
}

nb::tuple period_edges(const Integers& dropped, const Integers& count, const Doubles& span, const Doubles& reached) {
  Values edges;
  Numbers first = {0};
  for (size_t r = 0; r < span.size(); r++) {
    const Values own = edges_of({dropped.data()[r], count.data()[r]}, span.data()[r], reached.data()[r]);
    edges.insert(edges.end(), own.begin(), own.end());
    first.push_back(int64_t(edges.size()));
  }
  return nb::make_tuple(returned(std::move(edges)), returned(std::move(first)));
}

// n, value and spread of what belongs to each owner.
nb::tuple moments_of(const Doubles& values, const Integers& own, size_t owners) {
  std::vector<Values> of(owners);
  for (size_t k = 0; k < values.size(); k++) of.at(own.data()[k]).push_back(values.data()[k]);
  Numbers n;
  Values value, spread;
  for (const Values& one : of) {
    const Summary found = moments(one.data(), one.size());
    n.push_back(found.n);
    value.push_back(found.value);
    spread.push_back(found.spread);
  }
  return nb::make_tuple(returned(std::move(n)), returned(std::move(value)), returned(std::move(spread)));
}

// The same of runs, from those of their feet (runs, feet).
nb::tuple over_feet(const Integers& count, const Doubles& mean, const Doubles& spread, size_t feet, bool worst) {
  Numbers n;
  Values value, deviation;
  for (size_t r = 0; feet > 0 && r < count.size() / feet; r++) {
    std::vector<Summary> of;
    for (size_t k = r * feet; k < (r + 1) * feet; k++) of.push_back({mean.data()[k], spread.data()[k], count.data()[k]});
    const Summary found = of_feet(of, worst);
    n.push_back(found.n);
    value.push_back(found.value);
    deviation.push_back(found.spread);
  }
  return nb::make_tuple(returned(std::move(n)), returned(std::move(value)), returned(std::move(deviation)));
}

// Of runs (nr,): what their drives draw per period, mean and number; weights; way per period, mean and spread: (nr, 3).
nb::object transports(const Doubles& drawn, const Integers& count, const Doubles& weight, const Doubles& way, const Doubles& spread) {
  Values out;
  for (size_t r = 0; r < drawn.size(); r++) {
    const Summary one = transport({drawn.data()[r], NONE, count.data()[r]}, weight.data()[r], {way.data()[r], spread.data()[r], 0});
    out.insert(out.end(), {one.value, one.spread, double(one.n)});
  }
  return returned(std::move(out), 3);
}

struct Walks {
  std::vector<Marks> marks;
  std::vector<Walk> walks;

  // Of runs: the columns of their marks, slipped (nm, feet); own and span: the drive period between marks, and that of the measures [s].
  Walks(const std::vector<Doubles>& columns, size_t feet, const Integers& first, const Doubles& own, const Doubles& span, const Integers& dropped,
        const Integers& count) {
    const size_t runs = own.size();
    marks.resize(runs);
    for (size_t r = 0; r < runs; r++) {
      Marks& one = marks[r];
      one.feet = feet;
      Values* to[] = {&one.time, &one.surge, &one.lowest, &one.highest};
      for (int c = 0; c < 4; c++) *to[c] = edges_between(columns.at(c), first, r);
      one.slipped.assign(columns.at(4).data() + first.data()[r] * feet, columns[4].data() + first.data()[r + 1] * feet);
      walks.emplace_back(one, own.data()[r], int64_t(std::round(span.data()[r] / own.data()[r])), Used{dropped.data()[r], count.data()[r]});
    }
  }

  // Values of all periods of all runs.
  template <class Of>
  nb::object each(Of&& of) const {
    Values out;
    for (const Walk& walk : walks) {
      const Values found = of(walk);
      out.insert(out.end(), found.begin(), found.end());
    }
    return returned(std::move(out));
  }
  // Of feet: (periods, feet).
  template <class Of>
  nb::object each_foot(Of&& of) const {
    const size_t feet = marks.empty() ? 0 : marks[0].feet;
    Values out;
    for (const Walk& walk : walks) {
      std::vector<Values> by;
      for (size_t i = 0; i < feet; i++) by.push_back(of(walk, i));
      for (int64_t k = 0; k < walk.count(); k++) {
        for (const Values& one : by) out.push_back(one[k]);
      }
    }
    return returned(std::move(out));
  }
  template <class Of>
  nb::object each_run(Of&& of) const {
    Values out;
    for (const Marks& one : marks) out.push_back(of(one));
    return returned(std::move(out));
  }
  // Marks at the start and at the end of every period, counted through all runs, and its run.
  nb::tuple edges() const {
    Numbers begin, end, own;
    int64_t first = 0;
    for (size_t r = 0; r < walks.size(); r++) {
      for (int64_t k = 0; k < walks[r].count(); k++) {
        begin.push_back(first + walks[r].begin(k));
        end.push_back(first + walks[r].end(k));
        own.push_back(int64_t(r));
      }
      first += int64_t(marks[r].time.size());
    }
    return nb::make_tuple(returned(std::move(begin)), returned(std::move(end)), returned(std::move(own)));
  }
};

}  // namespace

void bind_measure(nb::module_& m) {
  m.attr("PER_WINDOW") = names_of(PER_WINDOW);
  m.attr("WHOLE_RUN") = names_of(WHOLE_RUN);
  m.attr("RESOLUTION") = RESOLUTION;
  m.attr("DWELL") = DWELL;
  m.attr("DWELL_SHARE") = DWELL_SHARE;
  m.attr("STANDSTILL") = STANDSTILL;
  nb::class_<Histories>(m, "Histories")
      .def_static("of_events", &of_events)
      .def_static("known", &known)
      .def("flights", &flights_of)
      .def("impacts", [](const Histories& of) { return points(of, &Foot::impacts); })
      .def("tops", [](const Histories& of) { return points(of, &Foot::tops); })
      .def("knots", [](const Histories& of) { return points(of, &Foot::knots); })
      .def("seen", [](const Histories& of, double height) { return numbers(of, [&](const Foot& foot, size_t) { return foot.seen(height); }); })
      .def("hops", [](const Histories& of, double height) { return numbers(of, [&](const Foot& foot, size_t) { return foot.hops(height); }); })
      .def("rebounds", [](const Histories& of, double height) { return numbers(of, [&](const Foot& foot, size_t) { return foot.rebounds(height); }); })
      .def("bounces", [](const Histories& of, double height, const Doubles& dwell) {
        of.check(dwell.size());
        return numbers(of, [&](const Foot& foot, size_t h) { return foot.bounces({height, dwell.data()[h]}); });
      })
      .def("contacts", &contacts)
      .def("shares", &shares)
      .def("in_windows", &in_windows)
      .def("in_whole_run", &in_whole_run);
  m.def("edge_numbers", &edge_numbers);
  m.def("window_numbers", &window_numbers);
  m.def("periods_used", &periods_used);
  m.def("period_edges", &period_edges);
  m.def("moments", &moments_of);
  m.def("over_feet", &over_feet);
  m.def("transports", &transports);
  nb::class_<Walks>(m, "Walks")
      .def(nb::init<const std::vector<Doubles>&, size_t, const Integers&, const Doubles&, const Doubles&, const Integers&, const Integers&>())
      .def("edges", &Walks::edges)
      .def("stride", [](const Walks& of) { return of.each([](const Walk& one) { return one.stride(); }); })
      .def("mean_speed", [](const Walks& of) { return of.each([](const Walk& one) { return one.mean_speed(); }); })
      .def("body_lengths_per_second", [](const Walks& of, const Doubles& length) {
        size_t run = 0;
        return of.each([&](const Walk& one) { return one.body_lengths_per_second(length.data()[run++]); });
      })
      .def("vertical_amplitude", [](const Walks& of) { return of.each([](const Walk& one) { return one.vertical_amplitude(); }); })
      .def("foot_slip", [](const Walks& of) { return of.each_foot([](const Walk& one, size_t foot) { return one.foot_slip(foot); }); })
      .def("slip_ratio", [](const Walks& of) { return of.each_foot([](const Walk& one, size_t foot) { return one.slip_ratio(foot); }); })
      .def("max_heave", [](const Walks& of) { return of.each_run(max_heave); })
      .def("max_surge", [](const Walks& of) { return of.each_run(max_surge); });
}

}  // namespace tarsus
