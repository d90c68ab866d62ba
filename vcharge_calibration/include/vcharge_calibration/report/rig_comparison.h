#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "vcharge_core/camera/camera_rig.h"

namespace vcharge {

/// How a camera's extrinsics differ between two rigs.
struct CameraDifference {
  std::string name;
  /// [dt, dphi] in the vehicle's frame, metres and radians: of the second rig against the first.
  Eigen::Matrix<double, 6, 1> difference = Eigen::Matrix<double, 6, 1>::Zero();
  /// Of the difference, by both rigs' covariances taken as independent; zero where neither has one.
  Eigen::Matrix<double, 6, 1> sigma = Eigen::Matrix<double, 6, 1>::Zero();
  bool has_sigma = false;
  /// Squared Mahalanobis length of the difference, 6 degrees of freedom.
  double chi_square = 0.0;
  bool is_significant = false;  ///< at 99.7 %
};

struct RigComparison {
  std::vector<CameraDifference> cameras;  ///< that both have
  std::vector<std::string> only_first, only_second;
};

/// Cameras are compared by name. InputError for a camera without extrinsics.
RigComparison compareRigs(const CameraRig& first, const CameraRig& second);

}  // namespace vcharge
