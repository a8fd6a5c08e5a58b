#include "derive/modal.hpp"
#include "derive/run.hpp"

namespace tarsus::modal {

TangentResult derive_modal(const Robot& robot, const RunData& run, const Beginning& start, const DataTangents& data,
                           const std::vector<Structural>& structural, const RunRecord& record, const SampleTimes& times,
                           PowerSlopes* powers) {
  ModalTangent march(robot.book, robot.nodes, robot.signals, robot.laws, robot.settings, run, start, data, robot.channels, structural);
  return march.run(record, times.at, times.count, powers);
}

}  // namespace tarsus::modal
