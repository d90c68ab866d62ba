#include "vcharge_ros/rig_health_conversions.h"

#include <cmath>
#include <string>

#include "vcharge_core/base/error.h"
#include "vcharge_core/motion/pose_step.h"
#include "vcharge_ros/conversions.h"

namespace vcharge {
namespace {

/// Metres or radians by which equal extrinsics may differ after they were written and read.
constexpr double kSameExtrinsics = 1e-9;

/// Root mean square per axis of three errors, from `first` on, that consist of a deviation and its sigma.
double rootMeanSquare(const vcharge_msgs::CameraHealth& camera, size_t first) {
  double squares = 0.0;
  for (size_t i = first; i < first + 3; ++i) {
    squares += camera.deviation[i] * camera.deviation[i] +
               camera.standard_deviations[i] * camera.standard_deviations[i];
  }
  if (!std::isfinite(squares)) {
    throw InputError(std::string(kRigHealthTopic) + ": camera " + camera.camera +
                     ": expected finite deviations");
  }
  return std::sqrt(squares / 3.0);
}

}  // namespace

std::optional<RigCondition> fromMessage(const vcharge_msgs::RigHealth& message, const CameraRig& rig) {
  if (message.cameras.size() != rig.cameras.size()) {
    throw InputError(std::string(kRigHealthTopic) + ": expected " + std::to_string(rig.cameras.size()) +
                     " cameras, got " + std::to_string(message.cameras.size()));
  }
  RigCondition condition = conditionAsCalibrated(rig);
  for (const vcharge_msgs::CameraHealth& camera : message.cameras) {
    const int index = rig.findCamera(camera.camera);
    if (index < 0) {
      throw InputError(std::string(kRigHealthTopic) + ": camera " + camera.camera + " is not in the rig");
    }
    const std::optional<RigidTransform>& in_use = rig.cameras[static_cast<size_t>(index)].vehicle_from_camera;
    const RigidTransform from = fromMessage(camera.vehicle_from_camera, kRigHealthTopic);
    if (!in_use || stepBetween(*in_use, from).norm() > kSameExtrinsics) {
      return std::nullopt;
    }
    if (camera.state == vcharge_msgs::CameraHealth::MOVED) {
      condition[static_cast<size_t>(index)] = {true, rootMeanSquare(camera, 0), rootMeanSquare(camera, 3)};
    }
  }
  return condition;
}

}  // namespace vcharge
