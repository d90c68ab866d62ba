#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "vcharge_core/camera/camera_rig.h"

namespace vcharge {

/// Difference of a camera's extrinsics between two rigs.
struct CameraDifference {
  std::string name;
  /// Second rig minus first, [dt, dphi] in the vehicle's frame, metres and radians.
  Eigen::Matrix<double, 6, 1> difference = Eigen::Matrix<double, 6, 1>::Zero();
  /// Standard deviations of the difference for independent rigs; zero if neither rig has a covariance.
  Eigen::Matrix<double, 6, 1> sigma = Eigen::Matrix<double, 6, 1>::Zero();
  bool has_sigma = false;
  /// Squared Mahalanobis distance, 6 degrees of freedom.
  double chi_square = 0.0;
  bool is_significant = false;  ///< significant at the level of 99.7 %
};

struct RigComparison {
  std::vector<CameraDifference> cameras;  ///< cameras that are in both rigs
  std::vector<std::string> only_first, only_second;
};

/// Compares cameras of the same name. InputError for a camera without extrinsics.
RigComparison compareRigs(const CameraRig& first, const CameraRig& second);

}  // namespace vcharge
