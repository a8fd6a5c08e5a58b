// Measures of a packaged run, from its events and marks, as those of tarsus.measure.measures_of without options.
#pragma once
#include "march/log.hpp"
#include "measure/moments.hpp"
#include "measure/walk.hpp"

namespace tarsus {

constexpr const char* WALKED[] = {"stride", "mean_speed", "body_lengths_per_second", "vertical_amplitude", "foot_slip", "slip_ratio", "electrical_energy", "cost_of_transport", "max_heave", "max_surge"};

// Names in the order of `page_measures`; of a robot that does not walk those of its feet alone.
inline std::vector<const char*> measure_names(bool walks) {
  std::vector<const char*> out;
  if (walks) out.assign(std::begin(WALKED), std::end(WALKED));
  for (const auto& one : measure::PER_WINDOW) out.push_back(one.name);
  for (const auto& one : measure::WHOLE_RUN) out.push_back(one.name);
  return out;
}

// A run as measures see it. period, reached [s]; marks (see legged::Notes) of so many body coordinates, none of a robot that does not
// walk, of length [m] and weight [N], whose drives draw so much [J] in a period (NaN where it is not known); worst: of each of the names whether it is that of the worst foot.
struct MeasuredRun {
  const std::vector<Event>& events;
  size_t feet;
  double period, reached;
  const std::vector<double>& marks;
  size_t body;
  double length, weight, drawn;
  const int64_t* worst;
};

inline void measure_walk(const MeasuredRun& run, const measure::Used& used, std::vector<measure::Summary>& out) {
  using namespace measure;
  const size_t width = 3 + run.body + 2 * run.feet;
  Marks marks;
  marks.feet = run.feet;
  for (const double* mark = run.marks.data(); mark < run.marks.data() + run.marks.size(); mark += width) {
    marks.time.push_back(mark[0]);
    marks.surge.push_back(mark[1]);
    for (size_t i = 0; i < run.feet; i++) marks.slipped.push_back(mark[1 + run.body + run.feet + i]);
    marks.lowest.push_back(mark[width - 2]);
    marks.highest.push_back(mark[width - 1]);
  }
  const Walk walk(marks, run.period, 1, used);
  const auto feet = [&](Values (Walk::*of)(size_t) const) {
    std::vector<Summary> each;
    for (size_t i = 0; i < run.feet; i++) {
      const Values values = (walk.*of)(i);
      each.push_back(moments(values.data(), values.size()));
    }
    return of_feet(each, run.worst[out.size()] != 0);
  };
  const Summary stride = of_robot(walk.stride());
  out.push_back(stride);
  out.push_back(of_robot(walk.mean_speed()));
  out.push_back(of_robot(walk.body_lengths_per_second(run.length)));
  out.push_back(of_robot(walk.vertical_amplitude()));
  out.push_back(feet(&Walk::foot_slip));
  out.push_back(feet(&Walk::slip_ratio));
  const Summary drawn = of_robot(Values(size_t(walk.count()), run.drawn));
  out.push_back(drawn);
  out.push_back(transport(drawn, run.weight, stride));
  for (double once : {max_heave(marks), max_surge(marks)}) out.push_back(moments(&once, 1));
}

inline std::vector<measure::Summary> page_measures(const MeasuredRun& run) {
  using namespace measure;
  const Used used = measure::used(run.reached, run.period);
  std::vector<Summary> out;
  if (run.body > 0) measure_walk(run, used, out);
  std::vector<std::vector<Happening>> events(run.feet);
  for (const Event& e : run.events) events[size_t(e.foot)].push_back({e.time, e.kind, e.before, e.apex, e.apex_time, e.gap_integral});
  std::vector<Foot> feet;
  for (auto& own : events) feet.emplace_back(std::move(own), run.reached);
  const Values edges = edges_of(used, run.period, run.reached);
  const Counting counting = usual(run.period);
  const auto over = [&](auto&& values_of) {
    std::vector<Summary> each;
    for (const Foot& foot : feet) {
      const Values values = values_of(foot);
      each.push_back(moments(values.data(), values.size()));
    }
    out.push_back(of_feet(each, run.worst[out.size()] != 0));
  };
  for (const PerWindow& one : PER_WINDOW) over([&](const Foot& foot) { return (Windows(foot, edges, counting).*one.of)(); });
  for (const InWholeRun& one : WHOLE_RUN) over([&](const Foot& foot) { return Values{one.of(foot, counting)}; });
  return out;
}

}  // namespace tarsus
