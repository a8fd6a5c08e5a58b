// Modal robots in Python: the book of contact modes.
#include "base/convert.hpp"
#include "modal/make.hpp"
#include "modal/unpack.hpp"

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
      : Book(sizes_of(from), from.doubles("lengths"), from.doubles("tangents"), structure_of(from, sizes_of(from))), maker(std::move(make)), nodes(n) {}

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

}  // namespace

void bind_modal(nb::module_& m) {
  nb::class_<Book>(m, "AnyBook");
  nb::class_<KeptBook, Book>(m, "Book")
      .def("__init__", [](KeptBook* out, nb::dict from, const Nodes& nodes, nb::object maker) { new (out) KeptBook(Given(std::move(from)), nodes, std::move(maker)); })
      .def_prop_ro("modes", &modes_of)
      .def("step", &step_of);
}

}  // namespace tarsus
