// Windows in Python: runs from given moments, and samples of recorded steps.
#include "convert.hpp"
#include "rows.hpp"
#include "window_modal.hpp"

namespace tarsus {

namespace {

typedef Array<uint8_t> Flags;

Halves halves_of(nb::handle module) {
  Halves out;
  copy_to(&out.left[0][0], N * N, module, "LEFT");
  copy_to(&out.right[0][0], N * N, module, "RIGHT");
  return out;
}

// Every window of a batch. times (runs,) [s]: where they start; held, leaving, since (runs, feet): see Start.
//
// Returns codes, events and where those of every run end, notes on them, finish, recorded steps and where those end.
nb::tuple run_modal_windows(Book& book, const Nodes& nodes, const Signals& signals, const Laws& laws, const Settings& settings,
                            nb::handle rows, const Doubles& times, const Flags& held, const Flags& leaving,
                            const Doubles& since) {
  if (laws.feet != book.sizes.feet) throw std::invalid_argument("the book and the laws are of different feet");
  const size_t m = laws.feet;
  const Rows given(rows, signals, m * laws.columns, 2 * size_t(book.sizes.coordinates), m, book.sizes.drives);
  const size_t runs = given.batch.runs;
  if (times.size() != runs || held.size() != runs * m || leaving.size() != runs * m || since.size() != runs * m) {
    throw std::invalid_argument("the sizes of the windows and of their starts differ");
  }
  std::vector<Start> starts;
  for (size_t r = 0; r < runs; r++) {
    starts.push_back({times.data()[r], held.data() + r * m, leaving.data() + r * m, since.data() + r * m});
  }
  WindowResult result;
  {
    nb::gil_scoped_release released;
    result = run_windows(book, nodes, signals, laws, settings, given.batch, starts);
  }
  ModalResult& r = result.runs;
  return nb::make_tuple(returned(std::move(r.codes)), returned_rows(std::move(r.events)), returned(std::move(r.event_end)),
                        returned_rows(std::move(result.notes)), returned(std::move(r.finish), 3),
                        returned(std::move(r.trace), recorded_width(book.sizes)), returned(std::move(result.trace_end)));
}

nb::object sample_modal(Book& book, const Nodes& nodes, nb::handle module, const Doubles& sources, const Doubles& trace,
                        const Doubles& times) {
  const size_t width = recorded_width(book.sizes);
  if (sources.size() != size_t(book.sizes.sources()) || trace.size() % width != 0) {
    throw std::invalid_argument("the sizes of a plan and of its recorded steps differ");
  }
  const Halves halves = halves_of(module);
  std::vector<double> out;
  {
    nb::gil_scoped_release released;
    out = sample_steps(book, nodes, halves, sources.data(), trace.data(), trace.size() / width, times.data(), times.size());
  }
  return returned(std::move(out), sample_width(book.sizes));
}

}  // namespace

void bind_window(nb::module_& m) {
  m.def("run_modal_windows", &run_modal_windows);
  m.def("sample_modal", &sample_modal);
}

}  // namespace tarsus
