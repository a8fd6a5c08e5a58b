// Runs of a modal robot, one after the other: the compiled entry.
#pragma once
#include "march/batch.hpp"
#include "march/window.hpp"
#include "modal/contact.hpp"

namespace tarsus::modal {

// A robot and what acts on it; channels: numbers of signals of every run.
struct Robot {
  Book& book;
  const Nodes& nodes;
  const Signals& signals;
  const Laws& laws;
  const Settings& settings;
  size_t channels;
};

// How they ended. event_end: events of run i are those from event_end[i - 1] on, likewise recorded rows by trace_end; finish (runs,
// 3): end time [s], steps, rejected steps; notes: of recorded runs, on their events, by the rows of all runs. Of the last run: the contact mode it is in, the one it
// goes on in (pending), which may be another, and the physical state. states (runs, 2 n), feet (runs, feet): of runs that were given a
// start, where each ended.
struct ModalResult {
  std::vector<int64_t> codes, event_end, trace_end;
  std::vector<double> finish, trace, physical, states;
  std::vector<CarriedFoot> feet;
  std::vector<Event> events;
  std::vector<Note> notes;
  const ContactMode *mode = nullptr, *pending = nullptr;
};

// ``starts``: where each run begins; none: all from t = 0 in the air, and film momenta of strong films count from where steps begin.
ModalResult run_modal(const Robot& robot, const std::vector<RunData>& runs, const std::vector<Beginning>& starts);

}  // namespace tarsus::modal
