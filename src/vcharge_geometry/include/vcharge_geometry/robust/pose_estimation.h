#pragma once

#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "vcharge_core/motion/rigid_transform.h"
#include "vcharge_geometry/robust/robust_options.h"
#include "vcharge_geometry/solvers/point_match.h"

namespace vcharge {

/// Pose of a rig in a map. Valid for kOk only.
struct PoseEstimate {
  EstimationStatus status = EstimationStatus::kNoConsensus;
  RigidTransform map_from_rig;
  /// Covariance over [dt, dphi] in the map frame (m, rad).
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
  std::vector<int> inliers;  ///< indices of matches, ascending
  int num_iterations = 0;
  double noise_rad = 0.0;  ///< standard deviation of a ray's direction, from the inliers
};

// Robust estimators (robust_estimation.h) that minimize the angles between rays and points. Deterministic and
// thread-safe. Ray directions must be unit vectors within 1e-6, otherwise kNotFinite. Throw
// std::invalid_argument for invalid options.

/// Any pose, from samples of three matches (generalized_three_point.h), refined in 6 degrees of freedom.
PoseEstimate estimateAbsolutePose(const std::vector<PointMatch>& matches, const RobustOptions& options);

/// Pose with known roll and pitch, from samples of two matches (upright_two_point.h), refined in 4 degrees of
/// freedom. upright_from_rig rotates the rig frame so that its z axis is vertical like the map's.
PoseEstimate estimateUprightPose(const std::vector<PointMatch>& matches,
                                 const Eigen::Quaterniond& upright_from_rig, const RobustOptions& options);

}  // namespace vcharge
