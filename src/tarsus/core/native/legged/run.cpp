#include "legged/run.hpp"

#include "legged/carried.hpp"

namespace tarsus::legged {

LeggedResult run_legged(const Walker& walker, const std::vector<RunData>& runs, const std::vector<Start>& starts,
                        const std::vector<SampleTimes>& times, bool account) {
  const Between between(walker.nodes);
  Settings units = walker.settings;
  Log log;
  Notes notes;
  LeggedMarch system(walker.body, walker.tables, walker.nodes, between, walker.signals, walker.laws, units, log, notes, account, walker.channels);
  LeggedResult out;
  out.mark_width = system.mark_width();
  out.sample_width = system.sample_width();
  out.energy_width = ENERGIES + system.shares.size();
  for (size_t run = 0; run < runs.size(); run++) {
    if (!starts.empty()) units.end = starts[run].end;
    if (!times.empty()) notes.ask(times[run].at, times[run].count, out.sample_width);
    system.begin(runs[run]);
    if (!starts.empty()) load(system, starts[run]);
    const Code code = march(system);
    out.note(code, system.clock, log);
    out.mark_end.push_back(int64_t(notes.marks.size() / out.mark_width));
    out.samples.insert(out.samples.end(), notes.samples.begin(), notes.samples.end());
    if (starts.empty() && run + 1 < runs.size()) continue;
    save(system, out);
    out.energies.insert(out.energies.end(), &system.energy.work, &system.energy.work + ENERGIES);
    out.energies.insert(out.energies.end(), system.shares.begin(), system.shares.end());
  }
  out.events = std::move(log.events);
  out.marks = std::move(notes.marks);
  return out;
}

}  // namespace tarsus::legged
