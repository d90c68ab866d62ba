#pragma once

#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "vcharge_core/motion/rigid_transform.h"
#include "vcharge_geometry/robust/robust_options.h"
#include "vcharge_geometry/solvers/point_match.h"

namespace vcharge {

/// Pose of a rig in a map. Filled for kOk only.
struct PoseEstimate {
  EstimationStatus status = EstimationStatus::kNoConsensus;
  RigidTransform map_from_rig;
  /// Over [dt, dphi] in the map's frame, metres and radians.
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
  std::vector<int> inliers;  ///< indices of matches, ascending
  int num_iterations = 0;
  double noise_rad = 0.0;  ///< standard deviation of a ray's direction, from the inliers
};

// Robust (robust_estimation.h) on the angles between rays and points, deterministic, thread-safe. Directions
// of rays must be unit vectors to 1e-6 (kNotFinite else). std::invalid_argument for invalid options.

/// Any pose: three matches a sample (generalized_three_point.h), refined in 6 degrees of freedom.
PoseEstimate estimateAbsolutePose(const std::vector<PointMatch>& matches, const RobustOptions& options);

/// Pose with known roll and pitch: two matches a sample (upright_two_point.h), refined in 4 degrees of
/// freedom. upright_from_rig turns the rig's frame so that its z axis is vertical, as the map's is.
PoseEstimate estimateUprightPose(const std::vector<PointMatch>& matches,
                                 const Eigen::Quaterniond& upright_from_rig, const RobustOptions& options);

}  // namespace vcharge
