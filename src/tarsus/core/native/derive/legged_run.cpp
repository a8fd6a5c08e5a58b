#include "derive/legged_tangent.hpp"
#include "derive/run.hpp"

namespace tarsus::legged {

LeggedDerived derive_legged(const Walker& walker, const Laws& programs, const RunData& run, const Beginning* start,
                            const SampleTimes& times, const Lanes& lanes, bool account) {
  const Between between(walker.nodes);
  const Settings units = start != nullptr ? start->ended(walker.settings) : walker.settings;
  Log log;
  Notes notes;
  LeggedTangent system(walker.body, walker.tables, walker.nodes, between, walker.signals, walker.laws, programs, units, log, notes, account,
                       walker.channels, run, lanes.data, lanes.count, lanes.copies);
  notes.ask(times.at, times.count, system.sample_width());
  system.begin(run);
  if (start != nullptr) begin_at(system, *start);
  system.begin_lanes(start != nullptr);
  march_on(system);
  system.finish();
  return {std::move(system.slopes), std::move(system.reported.events), std::move(system.reported.flags), log.events.size()};
}

}  // namespace tarsus::legged
