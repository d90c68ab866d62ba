#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "vcharge_core/base/options.h"
#include "vcharge_core/motion/rigid_transform.h"
#include "vcharge_geometry/robust/motion_estimation.h"
#include "vcharge_geometry/solvers/ray_match.h"

namespace vcharge {

struct EgoMotionOptions {
  RobustOptions robust = defaultRobust();
  int min_matches = 30;                   ///< fewer: the odometer alone
  double odometry_distance_sigma = 0.02;  ///< of the counted distance
  double odometry_sigma_m = 0.003;        ///< besides
  double odometry_turn_sigma = 0.05;      ///< of the counted turn
  double odometry_sigma_rad = 0.001;      ///< besides
  double side_slip_sigma_m = 0.002;       ///< of the Ackermann model
  /// A less constrained motion is taken when it explains this many times the matches.
  double min_gain = 1.1;

  static RobustOptions defaultRobust();

  template <class Visitor>
  void visitFields(Visitor&& visit) {
    visit("robust", robust);
    visit("min_matches", min_matches);
    visit("odometry_distance_sigma", odometry_distance_sigma);
    visit("odometry_sigma_m", odometry_sigma_m);
    visit("odometry_turn_sigma", odometry_turn_sigma);
    visit("odometry_sigma_rad", odometry_sigma_rad);
    visit("side_slip_sigma_m", side_slip_sigma_m);
    visit("min_gain", min_gain);
  }
  void validate() const;  ///< throws std::invalid_argument naming the field
};

/// Which motion explained a frame's matches.
enum class MotionHypothesis {
  kOdometry,   ///< too few matches, or none that agree: as the odometer counted
  kAckermann,  ///< a circle about a point on the rear axle's line (paper, equation AckermannMotion)
  kPlanar,     ///< any motion in the plane: the wheels slipped
  kSpatial,    ///< six degrees of freedom: a ramp, a bump
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

/// Motion of the vehicle between two frames: Lee et al.'s two-point method in a robust estimator over the
/// matches of all cameras (paper, section Ego-Motion Estimation), its length and turn fused with the
/// odometer's by their covariances, checked against less constrained motions. Deterministic.
EgoMotion estimateEgoMotion(const std::vector<RayMatch>& matches,
                            const RigidTransform& odometry_previous_from_current,
                            const EgoMotionOptions& options);

}  // namespace vcharge
