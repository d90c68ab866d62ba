#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "vcharge_core/camera/camera_rig.h"

namespace vcharge {

/// A camera's extrinsics against the truth.
struct CameraErrors {
  std::string name;
  /// [dt, dphi] in the vehicle's frame, metres and radians: true = estimate + dt, Exp(dphi) R.
  Eigen::Matrix<double, 6, 1> error = Eigen::Matrix<double, 6, 1>::Zero();
  /// Errors over their standard deviations; absent where the estimate has none.
  std::optional<Eigen::Matrix<double, 6, 1>> normalized;
};

struct RigErrors {
  /// Factor on all translations that fits the truth best: a rig from a drive has the odometer's scale.
  double scale = 1.0;
  std::vector<CameraErrors> as_is, without_scale;
};

/// Cameras are compared by name. InputError naming the camera that one of them lacks, or has no extrinsics.
RigErrors evaluateRig(const CameraRig& estimate, const CameraRig& truth);

}  // namespace vcharge
