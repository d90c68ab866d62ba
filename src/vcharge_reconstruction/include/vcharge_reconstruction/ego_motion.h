#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "vcharge_core/base/options.h"
#include "vcharge_core/motion/rigid_transform.h"
#include "vcharge_geometry/solvers/ray_match.h"

namespace vcharge {

/// Accuracy of the odometer's motion between two frames, against which the motion in the images is weighted.
struct EgoMotionOptions {
  VCHARGE_BEGIN_OPTIONS(EgoMotionOptions);
  VCHARGE_OPTION(double, odometry_distance_sigma, 0.02, positive(),
                 "Relative deviation of a counted distance.");
  VCHARGE_OPTION(double, odometry_sigma_m, 0.003, positive(), "Constant deviation of a counted distance.");
  VCHARGE_OPTION(double, odometry_turn_sigma, 0.05, positive(), "Relative deviation of a counted turn.");
  VCHARGE_OPTION(double, odometry_sigma_rad, 0.001, positive(), "Constant deviation of a counted turn.");
  VCHARGE_END_OPTIONS();
};

/// Motion model that explains a frame's matches.
enum class MotionHypothesis {
  kOdometry,   ///< the odometer's motion: too few matches agree
  kAckermann,  ///< a circle about a point on the rear axle's line (paper, equation AckermannMotion)
  kPlanar,     ///< any motion in the plane: the wheels slipped
  kSpatial,    ///< six degrees of freedom: a ramp or a bump
};
template <>
inline std::vector<std::string> enumNames<MotionHypothesis>() {
  return {"odometry", "ackermann", "planar", "spatial"};
}

struct EgoMotion {
  RigidTransform previous_from_current;
  MotionHypothesis hypothesis = MotionHypothesis::kOdometry;
  std::vector<bool> is_inlier;  ///< one per match
};

/// Motion of the vehicle between two frames: the two-point method of Lee et al. in a robust estimator over
/// the matches of all cameras (paper, section Ego-Motion Estimation), compared with less constrained motions,
/// and fused with the odometer's motion by their covariances. Matches are rays in the vehicle's frame.
/// Deterministic.
EgoMotion estimateEgoMotion(const std::vector<RayMatch>& matches,
                            const RigidTransform& odometry_previous_from_current,
                            const EgoMotionOptions& options);

}  // namespace vcharge
