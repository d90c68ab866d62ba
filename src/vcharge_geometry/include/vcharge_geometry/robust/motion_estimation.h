#pragma once

#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "vcharge_core/motion/rigid_transform.h"
#include "vcharge_geometry/robust/robust_options.h"
#include "vcharge_geometry/solvers/ray_match.h"

namespace vcharge {

/// Motion of a rig between two instants. Filled for kOk; for kScaleUnobservable the translation is a unit
/// vector and the covariance that of this direction (none along it).
struct MotionEstimate {
  EstimationStatus status = EstimationStatus::kNoConsensus;
  RigidTransform previous_from_current;
  /// Over [dt, dphi] in the previous frame, metres and radians; zero in directions that the motion model
  /// excludes.
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
  std::vector<int> inliers;  ///< indices of matches, ascending
  int num_iterations = 0;
  double noise_rad = 0.0;                 ///< standard deviation of a ray's direction, from the inliers
  double relative_scale_deviation = 0.0;  ///< standard deviation of the translation's length over the length
};

/// Whether at least rotation and direction of the motion are known.
inline bool isUsable(const MotionEstimate& estimate) {
  return estimate.status == EstimationStatus::kOk || estimate.status == EstimationStatus::kScaleUnobservable;
}

// All are robust (robust_estimation.h) on the angles by which rays miss a common epipolar plane
// (angular_error.h), deterministic, and thread-safe. Directions of rays must be unit vectors to 1e-6
// (kNotFinite else). std::invalid_argument for invalid options.

/// Car without slip on a plane: two matches a sample (ackermann_two_point.h); 2 degrees of freedom. The rig's
/// frame must lie at the centre of the non-steered axle, z up.
MotionEstimate estimateAckermannMotion(const std::vector<RayMatch>& matches, const RobustOptions& options);

/// Any motion in the x-y plane: three matches a sample (planar_three_point.h); 3 degrees of freedom.
MotionEstimate estimatePlanarMotion(const std::vector<RayMatch>& matches, const RobustOptions& options);

/// Any motion with known roll and pitch: four matches a sample (known_vertical_four_point.h); 4 degrees of
/// freedom. upright_from_previous and upright_from_current turn the rig's frame at either instant so that z
/// is vertical.
MotionEstimate estimateKnownVerticalMotion(const std::vector<RayMatch>& matches,
                                           const Eigen::Quaterniond& upright_from_previous,
                                           const Eigen::Quaterniond& upright_from_current,
                                           const RobustOptions& options);

/// Any motion of one camera whose centre is the origin of the rays: five matches a sample (Nister, PAMI 2004,
/// by OpenGV); rotation and direction of the translation (kScaleUnobservable), 5 degrees of freedom. Origins
/// of rays must be zero.
MotionEstimate estimateCentralMotion(const std::vector<RayMatch>& matches, const RobustOptions& options);

/// Local refinement of a motion in all 6 degrees of freedom, without sampling.
MotionEstimate refineMotion(const std::vector<RayMatch>& matches,
                            const RigidTransform& initial_previous_from_current,
                            const RobustOptions& options);

}  // namespace vcharge
