#pragma once

#include <vector>

#include "vcharge_core/camera/camera_rig.h"

namespace vcharge {

/// Whether a camera is where its rig says.
struct CameraCondition {
  bool has_moved = false;  ///< the rig is wrong about this camera
  // Standard deviations of its extrinsics per axis, or root mean square errors if it has moved.
  double position_sigma_m = 0.0;
  double rotation_sigma_rad = 0.0;

  bool operator==(const CameraCondition& other) const {
    return has_moved == other.has_moved && position_sigma_m == other.position_sigma_m &&
           rotation_sigma_rad == other.rotation_sigma_rad;
  }
};

/// One entry per camera, in the rig's order.
using RigCondition = std::vector<CameraCondition>;

/// The condition of a rig as it was calibrated: no camera has moved, and deviations are those of the
/// covariances; 0 without them.
RigCondition conditionAsCalibrated(const CameraRig& rig);

}  // namespace vcharge
