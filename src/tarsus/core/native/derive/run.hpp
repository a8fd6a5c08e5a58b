// Derivatives of runs: the compiled entries.
#pragma once
#include "derive/structure.hpp"
#include "derive/tangent.hpp"
#include "legged/run.hpp"
#include "modal/run.hpp"

namespace tarsus::modal {

class PowerSlopes;

// What a run came to: recorded steps, events and notes on them.
struct RunRecord {
  const double* trace;
  size_t rows;
  const Event* events;
  const Note* notes;
  size_t count;
};

struct TangentResult {
  std::vector<Row> events, samples;  // (events, EVENT_WIDTH), (times, sample width less held)
  std::vector<TangentFlag> flags;
};

// Derivatives of a recorded window in eight lanes. structural: the lanes whose numbers are the structure's own; powers: to be
// integrated, or null.
TangentResult derive_modal(const Robot& robot, const RunData& run, const Beginning& start, const DataTangents& data,
                           const std::vector<Structural>& structural, const RunRecord& record, const SampleTimes& times,
                           PowerSlopes* powers);

}  // namespace tarsus::modal

namespace tarsus::legged {

// A perturbed copy of the run's structure, its weight in the difference of a lane.
struct PerturbedBody {
  const Body* body;
  const LegTables* tables;
  double weight;
  int lane;
};

// Numbers of a run's lanes: derivatives of its data by them, how many of the eight there are, and copies for those of the structure.
struct Lanes {
  const DataTangents& data;
  int count;
  std::vector<PerturbedBody> copies;
};

// Derivatives of marks as in Notes, of samples (times, displacements and velocities, then gaps,
// rates, resistive and smooth forces and pulls of the feet); of where contacts began (feet) and energies at the end.
struct LeggedSlopes {
  std::vector<Row> marks, samples, since, energies;
};

struct LeggedDerived {
  LeggedSlopes slopes;
  std::vector<Row> events;  // (events, EVENT_WIDTH)
  std::vector<TangentFlag> flags;
  size_t count;  // events of the run
};

// Derivatives of a run in eight lanes. ``programs``: the laws by programs alone; start: where it begins, null: at t = 0; account:
// integrate energies.
LeggedDerived derive_legged(const Walker& walker, const Laws& programs, const RunData& run, const Beginning* start,
                            const SampleTimes& times, const Lanes& lanes, bool account);

}  // namespace tarsus::legged
