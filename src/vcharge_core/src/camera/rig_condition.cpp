#include "vcharge_core/camera/rig_condition.h"

#include <cmath>

namespace vcharge {

RigCondition conditionAsCalibrated(const CameraRig& rig) {
  RigCondition condition;
  for (const RigCamera& camera : rig.cameras) {
    CameraCondition entry;
    if (camera.covariance) {
      entry.position_sigma_m = std::sqrt(camera.covariance->topLeftCorner<3, 3>().trace() / 3.0);
      entry.rotation_sigma_rad = std::sqrt(camera.covariance->bottomRightCorner<3, 3>().trace() / 3.0);
    }
    condition.push_back(entry);
  }
  return condition;
}

}  // namespace vcharge
