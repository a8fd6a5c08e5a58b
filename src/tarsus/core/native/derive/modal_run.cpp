#include "derive/adjoint.hpp"
#include "derive/modal.hpp"
#include "derive/run.hpp"

namespace tarsus::modal {

TangentResult derive_modal(const Robot& robot, const RunData& run, const Beginning& start, const DataTangents& data,
                           const std::vector<Structural>& structural, const RunRecord& record, const SampleTimes& times,
                           PowerSlopes* powers) {
  ModalTangent march(robot.book, robot.nodes, robot.signals, robot.laws, robot.settings, run, start, data, robot.channels, structural);
  return march.run(record, times.at, times.count, powers);
}

AdjointResult adjoint(const Robot& robot, const RunData& run, const Beginning& start, const DataTangents& nothing,
                      const std::vector<int64_t>& groups, const std::vector<int64_t>& degrees, const RunRecord& record,
                      const Objective& objective) {
  const int64_t most = groups.empty() ? -1 : *std::max_element(groups.begin(), groups.end());
  const Directions of(robot.book.sizes, robot.channels, int(most + 1));
  std::vector<DataTangents> data;
  for (int b = 0; b < of.blocks(); b++) data.push_back(Lens::data(nothing, of, b * LANES, robot.signals, run.channels, groups));
  ModalAdjoint march(of, robot.signals, degrees, robot.channels, [&](int b) {
    return std::make_unique<Lens>(robot.book, robot.nodes, robot.signals, robot.laws, robot.settings, run, start, data[b], robot.channels, of, b * LANES);
  });
  return march.run(record, objective);
}

}  // namespace tarsus::modal
