#pragma once

#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "vcharge_core/motion/rigid_transform.h"
#include "vcharge_geometry/robust/robust_options.h"
#include "vcharge_geometry/solvers/ray_match.h"

namespace vcharge {

/// Motion of a rig between two instants. Valid for kOk. For kScaleUnobservable, the translation is a unit
/// vector with the covariance of its direction.
struct MotionEstimate {
  EstimationStatus status = EstimationStatus::kNoConsensus;
  RigidTransform previous_from_current;
  /// Covariance over [dt, dphi] in the previous frame (m, rad); zero in directions that the motion model
  /// excludes.
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
  std::vector<int> inliers;  ///< indices of matches, ascending
  int num_iterations = 0;
  double noise_rad = 0.0;  ///< standard deviation of a ray's direction, from the inliers
};

/// True if at least the rotation and the direction of the motion are known.
inline bool isUsable(const MotionEstimate& estimate) {
  return estimate.status == EstimationStatus::kOk || estimate.status == EstimationStatus::kScaleUnobservable;
}

// Robust estimators (robust_estimation.h) that minimize the angles by which rays miss a common epipolar plane
// (angular_error.h). Deterministic and thread-safe. Ray directions must be unit vectors within 1e-6,
// otherwise kNotFinite. Throw std::invalid_argument for invalid options.

/// Motion of a car without slip on a plane, from samples of two matches (ackermann_two_point.h); 2 degrees of
/// freedom. The origin of the rig frame must be the centre of the non-steered axle, z up.
MotionEstimate estimateAckermannMotion(const std::vector<RayMatch>& matches, const RobustOptions& options);

/// Any motion in the x-y plane, from samples of three matches (planar_three_point.h); 3 degrees of freedom.
MotionEstimate estimatePlanarMotion(const std::vector<RayMatch>& matches, const RobustOptions& options);

/// Any motion with known roll and pitch, from samples of four matches (known_vertical_four_point.h); 4
/// degrees of freedom. upright_from_previous and upright_from_current rotate the rig frame at each instant so
/// that z is vertical.
MotionEstimate estimateKnownVerticalMotion(const std::vector<RayMatch>& matches,
                                           const Eigen::Quaterniond& upright_from_previous,
                                           const Eigen::Quaterniond& upright_from_current,
                                           const RobustOptions& options);

/// Motion of a single camera from samples of five matches (Nister, PAMI 2004, by OpenGV): rotation and
/// direction of the translation (kScaleUnobservable), 5 degrees of freedom. The origins of all rays must be
/// zero.
MotionEstimate estimateCentralMotion(const std::vector<RayMatch>& matches, const RobustOptions& options);

/// Refines a motion locally in 6 degrees of freedom, without sampling.
MotionEstimate refineMotion(const std::vector<RayMatch>& matches,
                            const RigidTransform& initial_previous_from_current,
                            const RobustOptions& options);

}  // namespace vcharge
