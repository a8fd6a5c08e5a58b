// Runs of a walker, one after the other: the compiled entry.
#pragma once
#include "legged/body.hpp"
#include "legged/tables.hpp"
#include "laws/laws.hpp"
#include "march/window.hpp"

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

// How they ended. event_end: events of run i are those from event_end[i - 1] on, likewise marks (see Notes), rows of mark_width, by
// mark_end; finish (runs, 3): end time [s], steps, rejected steps; samples (moments of all runs, sample_width): see
// LeggedMarch::sample. states (runs, 2 n), feet (runs, feet) and energies (runs, .) at their ends: of runs that were given a start, else
// of the last one.
struct LeggedResult {
  std::vector<int64_t> codes, event_end, mark_end;
  std::vector<double> finish, marks, samples, states, energies;
  std::vector<CarriedFoot> feet;
  std::vector<Event> events;
  size_t mark_width, sample_width, energy_width;
};

// ``starts``: where each begins; none: all from t = 0. ``times``: of each; none: no samples. account: integrate energies.
LeggedResult run_legged(const Walker& walker, const std::vector<RunData>& runs, const std::vector<Beginning>& starts,
                        const std::vector<SampleTimes>& times, bool account);

struct LeggedMarch;

// March on a walker that has begun, whoever follows it.
Code march_on(LeggedMarch& system);

}  // namespace tarsus::legged
