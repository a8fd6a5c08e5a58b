// Modal robots in Python: the book of contact modes and the entry that runs a batch.
#include <nanobind/stl/tuple.h>

#include "base/convert.hpp"
#include "modal/make.hpp"
#include "modal/run.hpp"
#include "modal/unpack.hpp"
#include "march/rows.hpp"

namespace tarsus {

using namespace modal;

namespace {

nb::object mask_of(const FootSet& feet) {
  nb::object mask = nb::int_(0);
  for (size_t w = 0; w < feet.words.size(); w++) mask = mask | (nb::int_(feet.words[w]) << nb::int_(64 * w));
  return mask;
}

// The book with what it needs of Python: contact modes come from there, one call for each.
struct KeptBook : Book {
  nb::object maker;
  Nodes nodes;
  std::vector<nb::object> sources;  // tarsus.core.modes.ContactMode by number

  KeptBook(const Fields& from, const Nodes& n, nb::object make)
      : Book(sizes_of(from), from.doubles("lengths"), from.doubles("tangents")), maker(std::move(make)), nodes(n) {}

  std::unique_ptr<ContactMode> unpacked(nb::handle source, const FootSet& feet, int classes) const {
    return contact_mode_of(Given(nb::cast<nb::dict>(source.attr("arrays"))), *this, feet, classes);
  }

  // The only place of a run that needs Python; the book's own lock is never held while waiting for it.
  const ContactMode& make(const FootSet& feet) override {
    nb::gil_scoped_acquire python;
    const nb::object source = maker(mask_of(feet));
    std::unique_ptr<ContactMode> mode = unpacked(source, feet, classes());
    finish_mode(*mode, lengths);
    const ContactMode& kept = keep(std::move(mode));
    if (kept.number == int(sources.size())) sources.push_back(source);
    return kept;
  }

  std::unique_ptr<StepClass> new_step(const ContactMode& mode, int k) override {
    return make_step_tables(mode, lengths, k, nodes);
  }

};

FootSet feet_of(const Sizes& sizes, nb::handle mask) {
  FootSet feet(sizes.constraints());
  for (int i = 0; i < sizes.constraints(); i++) {
    if (nb::cast<bool>(nb::bool_(nb::borrow<nb::int_>(mask) >> nb::int_(i) & nb::int_(1)))) feet.toggle(i);
  }
  return feet;
}

nb::list modes_of(KeptBook& book) {
  nb::list out;
  for (const nb::object& source : book.sources) out.append(source);
  return out;
}

// Everything of a step, for tests of the tables.
nb::dict step_of(KeptBook& book, int q, int k) {
  const StepClass& step = book.step(book.numbered(q), k);
  const Sizes& s = book.sizes;
  nb::dict out;
  const auto put = [&out](const char* name, const double* at, size_t count) {
    out[name] = returned(std::vector<double>(at, at + count));
  };
  put("node_state", step.node_state, size_t(s.outputs) * s.state() * N);
  put("node_constant", step.node_constant, size_t(s.outputs) * s.inputs() * N);
  put("node_input", step.node_input, size_t(s.outputs) * s.inputs() * N * N);
  put("envelope", step.envelope, size_t(s.constraints()) * s.stride);
  put("exponential", step.exponential, 4 * size_t(s.stride));
  put("state_input", step.state_input, size_t(s.inputs()) * N * s.state());
  put("state_bias", step.state_bias, size_t(s.sources()) * s.state());
  put("node_bias", step.node_bias, size_t(s.sources()) * s.outputs * N);
  out["terms"] = step.terms;
  out["stride"] = s.stride;
  return out;
}

// Every run of a batch. ``begin``: where each starts, as times (runs,) [s], held, leaving and since (runs, feet): see Beginning; from
// t = 0 without it.
//
// Returns codes, events and where those of every run end, finish, recorded steps, and of the last run the contact mode it is in, the
// mask of the one in which it goes on, and its place; then notes on the events of recorded runs.
nb::tuple run_batch(KeptBook& book, const Nodes& nodes, const Signals& signals, const Laws& laws, const Settings& settings,
                    nb::handle rows, nb::object begin) {
  if (laws.feet != book.sizes.feet) throw std::invalid_argument("the book and the laws are of different feet");
  const size_t m = laws.feet;
  const Rows given(rows, signals, m * laws.columns, 2 * size_t(book.sizes.coordinates), m, book.sizes.drives);
  for (int64_t flags : laws.flags) {
    if (flags & USES_RATE && book.sizes.outputs == book.sizes.feet) throw std::invalid_argument("the book has no gap rates");
  }
  std::tuple<Doubles, Array<uint8_t>, Array<uint8_t>, Doubles> from;
  std::vector<Beginning> starts;
  if (!begin.is_none()) {
    from = nb::cast<decltype(from)>(begin);
    const auto& [times, held, leaving, since] = from;
    const size_t runs = given.batch.runs;
    if (times.size() != runs || held.size() != runs * m || leaving.size() != runs * m || since.size() != runs * m) {
      throw std::invalid_argument("the sizes of the windows and of their starts differ");
    }
    for (size_t r = 0; r < runs; r++) {
      starts.push_back({times.data()[r], held.data() + r * m, leaving.data() + r * m, since.data() + r * m});
    }
  }
  ModalResult result;
  {
    nb::gil_scoped_release released;
    result = run_modal({book, nodes, signals, laws, settings, given.batch.channels}, given.batch.all(), starts);
  }
  const Sizes& s = book.sizes;
  return nb::make_tuple(returned(std::move(result.codes)), returned_rows(std::move(result.events)),
                        returned(std::move(result.event_end)), returned(std::move(result.finish), 3),
                        returned(std::move(result.trace), recorded_width(s)),
                        result.mode == nullptr ? 0 : result.mode->number,
                        result.pending == nullptr ? nb::object(nb::int_(-1)) : mask_of(result.pending->feet),
                        returned(std::move(result.physical)), returned_rows(std::move(result.notes)));
}

}  // namespace

void bind_modal(nb::module_& m) {
  nb::class_<Book>(m, "AnyBook");
  nb::class_<KeptBook, Book>(m, "Book")
      .def("__init__", [](KeptBook* out, nb::dict from, const Nodes& nodes, nb::object maker) { new (out) KeptBook(Given(std::move(from)), nodes, std::move(maker)); })
      .def("require", [](KeptBook& book, nb::handle mask) { return book.require(feet_of(book.sizes, mask)).number; })
      .def_prop_ro("modes", &modes_of)
      .def("step", &step_of);
  m.def("run_modal", &run_batch, nb::arg("book"), nb::arg("nodes"), nb::arg("signals"), nb::arg("laws"), nb::arg("settings"),
        nb::arg("rows"), nb::arg("begin").none());
}

}  // namespace tarsus
