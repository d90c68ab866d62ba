#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "vcharge_core/camera/camera_rig.h"

namespace vcharge {

/// Errors of a camera's extrinsics.
struct CameraErrors {
  std::string name;
  /// [dt, dphi] in the vehicle's frame, in metres and radians: t_true = t + dt, R_true = Exp(dphi) R.
  Eigen::Matrix<double, 6, 1> error = Eigen::Matrix<double, 6, 1>::Zero();
  /// Errors over their standard deviations; absent if the estimate has no covariance.
  std::optional<Eigen::Matrix<double, 6, 1>> normalized;
};

struct RigErrors {
  /// Factor on all translations that fits the truth best. A calibration from a drive has the odometer's
  /// scale.
  double scale = 1.0;
  /// Normalized with and without the deviation of the estimate's scale.
  std::vector<CameraErrors> as_is, without_scale;
};

/// Compares cameras by name. InputError naming a camera that is missing or has no extrinsics.
RigErrors evaluateRig(const CameraRig& estimate, const CameraRig& truth);

}  // namespace vcharge
