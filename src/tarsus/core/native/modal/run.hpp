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

// Samples: see `sample_width`, and where an account is kept the energies up to then. Of the last run: Account::gap_range, and whether it would
// go on in another contact mode than it is in.
struct ModalResult : Outcome {
  std::vector<double> gap_range;
  bool changed = false;
};

// ``starts``: where each run begins; none: all from t = 0 in the air, and film momenta of strong films count from where steps begin.
// ``times``: of each; none: no samples. account: integrate energies.
ModalResult run_modal(const Robot& robot, const std::vector<RunData>& runs, const std::vector<Start>& starts,
                      const std::vector<SampleTimes>& times, bool account);

}  // namespace tarsus::modal
