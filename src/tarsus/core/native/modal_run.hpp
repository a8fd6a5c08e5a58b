// Runs of a modal robot, one after the other: the compiled entry.
#pragma once
#include "modal_contact.hpp"

namespace tarsus::modal {

// How they ended. event_end: events of run i are those from event_end[i - 1] on; finish (runs, 3): end time [s], steps,
// rejected steps. Of the last run: the contact mode it is in and its flowing state; and where it was about to enter
// another one (pending), that and the physical state.
struct ModalResult {
  std::vector<int64_t> codes, event_end;
  std::vector<double> finish, trace, state, physical;
  std::vector<Event> events;
  const ContactMode *mode = nullptr, *pending = nullptr;
};

// Where the last run ended.
inline void note_end(Modal& m, ModalResult& out) {
  if (m.strong && !m.entering) {  // a flowing state is none without the momenta's bases
    add_film_momenta(m);
    leave_mode(m, *m.mode);
  }
  const int nb = m.mode == nullptr ? 0 : m.mode->blocks_used;
  out.mode = m.mode;
  out.pending = m.entering ? m.next : nullptr;
  out.physical = m.physical;
  out.state.assign(m.state(), m.state() + nb);
  out.state.insert(out.state.end(), m.state() + m.sizes.stride, m.state() + m.sizes.stride + nb);
}

// How many blocks a state of that many modes has room for.
int modal_stride(int modes);

ModalResult run_modal(Book& book, const Nodes& nodes, const Signals& signals, const Laws& laws, const Settings& settings,
                      const Batch& batch);

}  // namespace tarsus::modal
