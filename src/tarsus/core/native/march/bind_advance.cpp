// Runs in Python, of any plan: whole ones, and parts that go on from where they are, each to a time of its own.
#include <nanobind/stl/tuple.h>

#include "base/convert.hpp"
#include "legged/run.hpp"
#include "march/rows.hpp"
#include "modal/run.hpp"

namespace tarsus {

namespace {

// How many numbers a plan has of each.
struct Widths {
  size_t states, feet, columns, drives, profile;
};

// What runs run on: a pool of signals and rows of data.
struct Data {
  const Signals& signals;
  Rows rows;
};

// on: a list of (signals, rows).
std::vector<Data> data_of(nb::list on, const Widths& of) {
  std::vector<Data> out;
  for (nb::handle item : on) {
    const auto [signals, rows] = nb::cast<std::tuple<const Signals*, nb::object>>(item);
    out.push_back({*signals, Rows(rows, *signals, of.columns, of.states, of.feet, of.drives, of.profile)});
  }
  return out;
}

// Some runs on the same data. starts, times: of each, or none.
struct Together {
  const Data& on;
  std::vector<RunData> runs;
  std::vector<Start> starts;
  std::vector<SampleTimes> times;
};

// Where parts start and how far they go: states (nr, 2n); at, until (nr) [s]; feet (nr, feet, CARRIED); data and row (nr, 2): what each
// runs on. None: whole runs, of all rows of the one data.
struct Continuations {
  Doubles states, at, until, feet;
  Integers on;
  bool given;
  size_t width;

  Continuations(nb::object from, const Widths& of, const std::vector<Data>& data) : given(!from.is_none()), width(of.feet) {
    if (!given) return;
    std::tie(states, at, until, feet, on) = nb::cast<std::tuple<Doubles, Doubles, Doubles, Doubles, Integers>>(from);
    const size_t count = at.size();
    if (states.size() != count * of.states || until.size() != count || feet.size() != count * width * CARRIED || on.size() != 2 * count) {
      throw std::invalid_argument("the sizes of runs and of their starts differ");
    }
    for (size_t r = 0; r < count; r++) {
      const int64_t k = on.data()[2 * r], row = on.data()[2 * r + 1];
      if (k < 0 || size_t(k) >= data.size() || row < 0 || size_t(row) >= data[size_t(k)].rows.batch.runs) {
        throw std::invalid_argument("a run has no such data");
      }
    }
  }

  size_t count(const std::vector<Data>& data) const { return given ? at.size() : data.at(0).rows.batch.runs; }
  size_t source(size_t r) const { return given ? size_t(on.data()[2 * r]) : 0; }
  RunData run(size_t r, const Data& data) const {
    RunData out = data.rows.batch.of(given ? size_t(on.data()[2 * r + 1]) : r);
    if (given) out.initial = states.data() + r * data.rows.batch.initial;
    return out;
  }
  Start start(size_t r) const {
    return {at.data()[r], until.data()[r], reinterpret_cast<const CarriedFoot*>(feet.data()) + r * width};
  }
};

// When runs are sampled: times [s] of all, end to end, those of run r from first[r] to first[r + 1]; None: never.
struct Sampled {
  Doubles times;
  Integers first;
  bool given;

  Sampled(nb::object from, size_t runs) : given(!from.is_none()) {
    if (!given) return;
    std::tie(times, first) = nb::cast<std::tuple<Doubles, Integers>>(from);
    bool fits = first.size() == runs + 1 && first.data()[0] == 0 && size_t(first.data()[runs]) == times.size();
    for (size_t r = 0; fits && r < runs; r++) fits = first.data()[r] <= first.data()[r + 1];
    if (!fits) throw std::invalid_argument("the sizes of runs and of their times differ");
  }
  SampleTimes of(size_t r) const { return {times.data() + first.data()[r], size_t(first.data()[r + 1] - first.data()[r])}; }
};

// Calls ``run`` with the runs that are on the same data one after the other.
template <class Run>
void each_together(const std::vector<Data>& data, const Continuations& parts, const Sampled& sampled, Run run) {
  const size_t count = parts.count(data);
  for (size_t r = 0; r < count;) {
    const size_t source = parts.source(r);
    Together out{data[source], {}, {}, {}};
    for (; r < count && parts.source(r) == source; r++) {
      out.runs.push_back(parts.run(r, out.on));
      if (parts.given) out.starts.push_back(parts.start(r));
      if (sampled.given) out.times.push_back(sampled.of(r));
    }
    run(out);
  }
}

template <class T>
void append(std::vector<T>& to, std::vector<T>&& more) {
  if (to.empty()) {
    to = std::move(more);
  } else {
    to.insert(to.end(), more.begin(), more.end());
  }
}

void append(Outcome& to, Outcome&& more) {
  for (int64_t& end : more.event_end) end += int64_t(to.events.size());
  append(to.codes, std::move(more.codes));
  append(to.event_end, std::move(more.event_end));
  append(to.finish, std::move(more.finish));
  append(to.samples, std::move(more.samples));
  append(to.states, std::move(more.states));
  append(to.energies, std::move(more.energies));
  to.sample_width = more.sample_width;
  to.energy_width = more.energy_width;
  append(to.feet, std::move(more.feet));
  append(to.events, std::move(more.events));
}

nb::tuple returned_as(Outcome&& out, const Widths& of) {
  return nb::make_tuple(returned(std::move(out.codes)), returned(std::move(out.finish), 3), returned_rows(std::move(out.events)),
                        returned(std::move(out.event_end)), returned(std::move(out.states), of.states), returned_rows(std::move(out.feet)),
                        returned(std::move(out.samples), out.sample_width), returned(std::move(out.energies), out.energy_width));
}

// Returns what all come to (see Outcome), and of the last run the range of its feet's gaps (see ModalResult), and whether it would go on in
// another contact mode.
nb::tuple advance_modal(modal::Book& book, const Nodes& nodes, const Laws& laws, const Settings& settings, nb::list on, nb::object starts,
                        nb::object times, bool account) {
  const modal::Sizes& sizes = book.sizes;
  const size_t m = size_t(sizes.feet);
  if (laws.feet != sizes.feet) throw std::invalid_argument("the book and the laws are of different feet");
  for (int64_t flags : laws.flags) {
    if (flags & USES_RATE && sizes.outputs == sizes.feet) throw std::invalid_argument("the book has no gap rates");
  }
  const Widths of{2 * size_t(sizes.coordinates), m, m * laws.columns, size_t(sizes.drives), 0};
  const std::vector<Data> data = data_of(on, of);
  const Continuations parts(starts, of, data);
  const Sampled sampled(times, parts.count(data));
  modal::ModalResult out;
  {
    nb::gil_scoped_release released;
    each_together(data, parts, sampled, [&](const Together& some) {
      modal::ModalResult made = modal::run_modal({book, nodes, some.on.signals, laws, settings, some.on.rows.batch.channels}, some.runs,
                                                 some.starts, some.times, account);
      out.gap_range = std::move(made.gap_range);
      out.changed = made.changed;
      append(out, std::move(made));
    });
  }
  return nb::make_tuple(returned_as(std::move(out), of), returned(std::move(out.gap_range)), out.changed);
}

// Returns what all come to (see Outcome), then marks and where those of each run end.
nb::tuple advance_legged(const legged::Body& body, const legged::LegTables& tables, const Nodes& nodes, const Laws& laws,
                         const Settings& settings, nb::list on, nb::object starts, nb::object times, bool account) {
  const size_t m = size_t(body.feet());
  if (laws.feet != body.feet()) throw std::invalid_argument("the body and the laws are of different feet");
  const Widths of{2 * size_t(body.all_coordinates()), m, m * laws.columns, body.drives, body.shape()};
  const std::vector<Data> data = data_of(on, of);
  const Continuations parts(starts, of, data);
  const Sampled sampled(times, parts.count(data));
  legged::LeggedResult out{};
  {
    nb::gil_scoped_release released;
    each_together(data, parts, sampled, [&](const Together& some) {
      legged::LeggedResult made = legged::run_legged({body, tables, nodes, some.on.signals, laws, settings, some.on.rows.batch.channels}, some.runs,
                                                     some.starts, some.times, account);
      out.mark_width = made.mark_width;
      for (int64_t& end : made.mark_end) end += int64_t(out.marks.size() / made.mark_width);
      append(out.mark_end, std::move(made.mark_end));
      append(out.marks, std::move(made.marks));
      append(out, std::move(made));
    });
  }
  const size_t width = out.mark_width;
  return nb::make_tuple(returned_as(std::move(out), of), returned(std::move(out.marks), width), returned(std::move(out.mark_end)));
}

}  // namespace

void bind_advance(nb::module_& m) {
  m.def("advance_modal", &advance_modal, nb::arg("book"), nb::arg("nodes"), nb::arg("laws"), nb::arg("settings"), nb::arg("on"),
        nb::arg("starts").none(), nb::arg("times").none(), nb::arg("account"));
  m.def("advance_legged", &advance_legged, nb::arg("body"), nb::arg("tables"), nb::arg("nodes"), nb::arg("laws"), nb::arg("settings"),
        nb::arg("on"), nb::arg("starts").none(), nb::arg("times").none(), nb::arg("account"));
  m.attr("CARRIED") = CARRIED;
}

}  // namespace tarsus
