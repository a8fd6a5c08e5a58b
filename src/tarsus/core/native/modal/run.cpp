#include "modal/run.hpp"

#include "modal/system.hpp"

namespace tarsus::modal {

namespace {

template <class S>
ModalResult run_all(Book& book, const Nodes& nodes, const Signals& signals, const Laws& laws, const Settings& settings,
                    const Batch& batch) {
  ModalSystem<S> system(book, nodes, signals, laws, settings, batch.channels);
  ModalResult out;
  for (size_t run = 0; run < batch.runs; run++) {
    system.begin(batch.of(run));
    out.codes.push_back(march(system));
    out.event_end.push_back(int64_t(system.log.events.size()));
    const Clock& clock = system.clock;
    out.finish.insert(out.finish.end(), {clock.time, double(clock.steps), double(clock.rejected)});
  }
  out.events = std::move(system.log.events);
  note_end(system, out);
  out.trace = std::move(system.trace);
  return out;
}

}  // namespace

int modal_stride(int modes) {
  if (modes <= 2) return 2;
  if (modes <= 4) return 4;
  return (modes + 7) / 8 * 8;
}

ModalResult run_modal(Book& book, const Nodes& nodes, const Signals& signals, const Laws& laws, const Settings& settings,
                      const Batch& batch) {
  return by_shape(book.sizes.stride, [&](auto shape) {
    return run_all<decltype(shape)>(book, nodes, signals, laws, settings, batch);
  });
}

}  // namespace tarsus::modal
