// Runs of a modal robot, one after the other: the compiled entry.
#pragma once
#include "modal/contact.hpp"

namespace tarsus::modal {

// How they ended. event_end: events of run i are those from event_end[i - 1] on; finish (runs, 3): end time [s], steps,
// rejected steps. Of the last run: the contact mode it is in, the one it goes on in (pending), which may be another, and the
// physical state.
struct ModalResult {
  std::vector<int64_t> codes, event_end;
  std::vector<double> finish, trace, physical;
  std::vector<Event> events;
  const ContactMode *mode = nullptr, *pending = nullptr;
};

// Where the last run ended. What a step has left of its momenta shows the velocities at its end: they do not jump once more where
// no step follows.
inline void note_end(Modal& m, ModalResult& out) {
  if (!m.entering) {
    if (m.settings.record && !m.trace.empty()) {
      for (int i : m.mode->free) {
        if (m.laws.has(i, HAS_MOMENTUM)) m.shift(m.mode->beta, i, m.feet[i].momentum);
      }
      m.trace[m.trace.size() - recorded_width(m.sizes) + T_JUMPS] -= m.jumped;
    } else {
      add_film_momenta(m);
    }
    leave_mode(m, *m.mode);
  }
  out.mode = m.mode;
  out.pending = m.next;
  out.physical = m.physical;
}

// How many blocks a state of that many modes has room for.
int modal_stride(int modes);

ModalResult run_modal(Book& book, const Nodes& nodes, const Signals& signals, const Laws& laws, const Settings& settings,
                      const Batch& batch);

}  // namespace tarsus::modal
