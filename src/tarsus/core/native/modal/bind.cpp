// Modal robots in Python: the book of contact modes and the entry that runs a batch.
#include <nanobind/stl/tuple.h>

#include "base/convert.hpp"
#include "derive/derived_mode.hpp"
#include "modal/run.hpp"
#include "march/rows.hpp"

namespace tarsus {

using namespace modal;

namespace {

// Rows of states (2 nb) with room for more blocks: (count, 2 nb) to (count, 2 stride).
void widen(double* to, nb::handle mode, const char* name, int blocks, int stride) {
  const std::vector<double> from = field<double>(mode, name);
  if (blocks == 0) return;
  for (size_t row = 0; row < from.size() / (2 * blocks); row++) {
    for (int b = 0; b < blocks; b++) {
      to[row * 2 * stride + b] = from[row * 2 * blocks + b];
      to[row * 2 * stride + stride + b] = from[row * 2 * blocks + blocks + b];
    }
  }
}

void copy_field(double* to, nb::handle mode, const char* name) {
  const std::vector<double> from = field<double>(mode, name);
  std::copy(from.begin(), from.end(), to);
}

// What tarsus.core.modes made of a structure with some feet held.
std::unique_ptr<ContactMode> contact_mode_of(nb::handle source, const Book& book, const FootSet& feet, int classes) {
  const Sizes& sizes = book.sizes;
  std::vector<int> leading;
  for (int64_t foot : field<int64_t>(source, "leading")) leading.push_back(int(foot));
  auto mode = std::make_unique<ContactMode>(sizes, feet, leading, classes);
  const std::vector<double> blocks = field<double>(source, "blocks"), back = field<double>(source, "from_physical");
  const int nb = int(blocks.size() / 4), ns = sizes.stride, n2 = 2 * sizes.coordinates;
  mode->blocks_used = nb;
  for (int i : mode->held) {
    if (!mode->is_stuck[i] && book.has_way(i)) mode->sliding.push_back(i);
  }
  for (int b = 0; b < nb; b++) {
    for (int e = 0; e < 4; e++) mode->blocks[e * ns + b] = blocks[4 * b + e];
    for (int c = 0; c < n2; c++) {
      mode->from_physical[b * n2 + c] = back[b * n2 + c];
      mode->from_physical[(ns + b) * n2 + c] = back[(nb + b) * n2 + c];
    }
  }
  widen(mode->inputs, source, "inputs", nb, ns);
  widen(mode->outputs, source, "outputs", nb, ns);
  widen(mode->beta, source, "beta", nb, ns);
  widen(mode->to_physical, source, "to_physical", nb, ns);
  widen(mode->held_rows, source, "held", nb, ns);
  widen(mode->jump, source, "jump", nb, ns);
  widen(mode->side, source, "side", nb, ns);
  widen(mode->side_rate, source, "side_rate", nb, ns);
  widen(mode->printed, source, "printed", nb, ns);
  copy_field(mode->feed, source, "feed");
  copy_field(mode->feed_rate, source, "feed_rate");
  copy_field(mode->held_feed, source, "held_feed");
  copy_field(mode->mobility, source, "mobility");
  copy_field(mode->reaction, source, "reaction");
  copy_field(mode->skew, source, "skew");
  copy_field(mode->printed_feed, source, "printed_feed");
  copy_field(mode->printed_damping, source, "printed_damping");
  copy_field(mode->spanned, source, "spanned");
  copy_field(mode->placed, source, "placed");
  widen(mode->slide, source, "slide", nb, ns);
  widen(mode->slide_rate, source, "slide_rate", nb, ns);
  copy_field(mode->slide_feed, source, "slide_feed");
  const nb::object bias = source.attr("bias");
  widen(mode->bias_inputs, bias, "inputs", nb, ns);
  copy_field(mode->bias_feed, bias, "feed");
  copy_field(mode->bias_offset, bias, "offset");
  copy_field(mode->bias_held, bias, "held_feed");
  copy_field(mode->bias_printed, bias, "printed_feed");
  for (int i = 0; i < sizes.inputs(); i++) {
    const double* row = mode->inputs + i * 2 * ns;
    for (int b = 0; b < nb; b++) mode->input_norm[i * ns + b] = std::hypot(row[b], row[ns + b]);
  }
  return mode;
}

nb::object mask_of(const FootSet& feet) {
  nb::object mask = nb::int_(0);
  for (size_t w = 0; w < feet.words.size(); w++) mask = mask | (nb::int_(feet.words[w]) << nb::int_(64 * w));
  return mask;
}

// The book with what it needs of Python: contact modes come from there, one call for each.
struct KeptBook : Book {
  nb::object maker;
  Nodes nodes;
  Quadrature quadrature = {};
  std::vector<nb::object> sources;  // tarsus.core.modes.ContactMode by number

  KeptBook(const Sizes& s, std::vector<double> h, std::vector<double> tangents, const Nodes& n, nb::handle module, nb::object make)
      : Book(s, std::move(h), std::move(tangents)), maker(std::move(make)), nodes(n) {
    double points[POINTS], weights[POINTS], at_points[POINTS][N];
    copy_to(points, POINTS, module, "GAUSS");
    copy_to(weights, POINTS, module, "GAUSS_WEIGHTS");
    copy_to(&at_points[0][0], POINTS * N, module, "AT_GAUSS");
    for (int a = 0; a < N; a++) {
      for (int g = 0; g < POINTS; g++) {
        double share = weights[g] * at_points[g][a];
        for (int n = 0; n < SERIES; n++) {
          quadrature.series[n][a] += share;
          share *= (1.0 - points[g]) / (n + 1);
        }
      }
    }
    copy_to(&quadrature.left[0][0], N * N, module, "LEFT");
    copy_to(&quadrature.right[0][0], N * N, module, "RIGHT");
    copy_to(&quadrature.partial[0][0][0], N * N * N, module, "PARTIAL");
    quadrature.spacing = nb::cast<double>(module.attr("SPACING"));
  }

  // The only place of a run that needs Python; the book's own lock is never held while waiting for it.
  const ContactMode& make(const FootSet& feet) override {
    nb::gil_scoped_acquire python;
    const nb::object source = maker(mask_of(feet));
    std::unique_ptr<ContactMode> mode = contact_mode_of(source, *this, feet, classes());
    finish_mode(*mode, lengths);
    const ContactMode& kept = keep(std::move(mode));
    if (kept.number == int(sources.size())) sources.push_back(source);
    return kept;
  }

  std::unique_ptr<StepClass> new_step(const ContactMode& mode, int k) override {
    return make_step_tables(mode, lengths, k, nodes, quadrature);
  }

};

// The derivatives of a book by a number of the structure, which Python makes of its contact modes.
struct KeptDerivedBook : DerivedBook {
  nb::object maker;

  KeptDerivedBook(KeptBook& book, nb::object make) : DerivedBook(book), maker(std::move(make)) {}

 protected:
  const KeptBook& kept() const { return static_cast<const KeptBook&>(book); }

  std::unique_ptr<DerivedMode> make(const ContactMode& of) override {
    nb::gil_scoped_acquire python;
    const nb::object found = maker(kept().sources[of.number]);
    auto out = std::make_unique<DerivedMode>();
    out->rows = contact_mode_of(found[0], book, of.feet, 0);
    const int blocks = of.blocks_used, ns = book.sizes.stride;
    const std::vector<double> from = copied(nb::cast<Doubles>(found[1]));
    if (out->rows->blocks_used != blocks || from.size() != 4 * size_t(blocks) * blocks) throw std::invalid_argument("the derivatives are those of another contact mode");
    out->coupling.assign(4 * size_t(ns) * ns, 0.0);
    for (int r = 0; r < 2 * blocks; r++) {
      for (int c = 0; c < 2 * blocks; c++) {
        out->coupling[size_t(r / blocks * ns + r % blocks) * 2 * ns + c / blocks * ns + c % blocks] = from[size_t(r) * 2 * blocks + c];
      }
    }
    return out;
  }
  std::unique_ptr<DerivedStep> new_step(const ContactMode& of, const DerivedMode& by, int k) override {
    return derive_step(of, by, book.lengths, k, kept().nodes, kept().quadrature);
  }
};

// tangents (feet, coordinates), or (0, coordinates) where no foot knows its way along the ground.
void make_book(KeptBook* out, const Doubles& lengths, int feet, int drives, int coordinates, bool rates, const Doubles& tangents,
               const Nodes& nodes, nb::handle module, nb::object maker) {
  const int ways = int(tangents.shape(0));
  const Sizes sizes{feet, drives, coordinates, modal_stride(coordinates), rates || ways > 0 ? 2 * feet : feet, ways};
  new (out) KeptBook(sizes, copied(lengths), copied(tangents), nodes, module, std::move(maker));
}

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
    result = run_modal(book, nodes, signals, laws, settings, given.batch.all(), given.batch.channels, starts);
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
      .def("__init__", &make_book)
      .def("require", [](KeptBook& book, nb::handle mask) { return book.require(feet_of(book.sizes, mask)).number; })
      .def_prop_ro("modes", &modes_of)
      .def("step", &step_of);
  nb::class_<DerivedBook>(m, "AnyDerivedBook");
  nb::class_<KeptDerivedBook, DerivedBook>(m, "DerivedBook").def(nb::init<KeptBook&, nb::object>(), nb::keep_alive<1, 2>());
  m.def("run_modal", &run_batch, nb::arg("book"), nb::arg("nodes"), nb::arg("signals"), nb::arg("laws"), nb::arg("settings"),
        nb::arg("rows"), nb::arg("begin").none());
}

}  // namespace tarsus
