// Runs of a modal robot, one after the other: the compiled entry.
#pragma once
#include "march/batch.hpp"
#include "march/carried.hpp"
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

// Recorded rows of run i are those of trace from trace_end[i - 1] on; changed: whether the last run would go on in another contact mode
// than it is in.
struct ModalResult : Outcome {
  std::vector<int64_t> trace_end;
  std::vector<double> trace;
  bool changed = false;
};

// ``starts``: where each run begins; none: all from t = 0 in the air, and film momenta of strong films count from where steps begin.
ModalResult run_modal(const Robot& robot, const std::vector<RunData>& runs, const std::vector<Start>& starts);

}  // namespace tarsus::modal
