// Runs of a walker, one after the other: the compiled entry.
#pragma once
#include "legged/body.hpp"
#include "legged/tables.hpp"
#include "laws/laws.hpp"
#include "march/carried.hpp"

namespace tarsus::legged {

// A walker and what acts on it; channels: numbers of signals of every run.
struct Walker {
  const Body& body;
  const LegTables& tables;
  const Nodes& nodes;
  const Signals& signals;
  const Laws& laws;
  const Settings& settings;
  size_t channels;
};

// Marks (see Notes) of run i, rows of mark_width, are those from mark_end[i - 1] on; samples (moments of all runs, sample_width): see
// LeggedMarch::sample.
struct LeggedResult : Outcome {
  std::vector<int64_t> mark_end;
  std::vector<double> marks;
  size_t mark_width;
};

// ``starts``: where each begins; none: all from t = 0. ``times``: of each; none: no samples. account: integrate energies.
LeggedResult run_legged(const Walker& walker, const std::vector<RunData>& runs, const std::vector<Start>& starts,
                        const std::vector<SampleTimes>& times, bool account);

}  // namespace tarsus::legged
