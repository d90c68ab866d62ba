#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "vcharge_core/base/options.h"
#include "vcharge_core/motion/rigid_transform.h"

namespace vcharge {

struct HandEyeOptions {
  int min_motions = 6;
  int num_iterations = 30;   ///< of reweighting
  double loss_sigmas = 2.0;  ///< scale of the Cauchy loss
  double max_inlier_sigmas = 5.0;
  double odometry_sigma_m = 0.005;  ///< of a motion's translation
  double odometry_sigma_rad = 0.002;
  // Less certain: there was not enough turning.
  double max_sigma_rad = 0.05;
  double max_sigma_m = 0.5;

  template <class Visitor>
  void visitFields(Visitor&& visit) {
    visit("min_motions", min_motions);
    visit("num_iterations", num_iterations);
    visit("loss_sigmas", loss_sigmas);
    visit("max_inlier_sigmas", max_inlier_sigmas);
    visit("odometry_sigma_m", odometry_sigma_m);
    visit("odometry_sigma_rad", odometry_sigma_rad);
    visit("max_sigma_rad", max_sigma_rad);
    visit("max_sigma_m", max_sigma_m);
  }
  void validate() const;  ///< throws std::invalid_argument naming the field
};

/// How vehicle and camera moved between two instants, previous_from_current.
struct MotionPair {
  RigidTransform vehicle;              ///< planar, as the odometer counted
  Eigen::Quaterniond camera_rotation;  ///< in the camera's frame
  Eigen::Vector3d camera_direction;    ///< unit vector, of the translation
  double rotation_sigma_rad = 0.001;
  double direction_sigma_rad = 0.01;
  bool has_direction = true;  ///< false: the camera hardly moved
  int32_t keyframe = 0;       ///< a label: where the motion begins
};

enum class HandEyeStatus {
  kOk,
  kTooFewMotions,
  kNoTurn,       ///< roll and pitch, or the place, are not observable: the vehicle went straight
  kNoAgreement,  ///< most motions of camera and odometer contradict each other
};

struct HandEye {
  HandEyeStatus status = HandEyeStatus::kTooFewMotions;
  RigidTransform vehicle_from_camera;  ///< z is zero: planar motion does not show it
  double tilt_sigma_rad = 0.0;         ///< of roll and pitch, the larger
  double yaw_sigma_rad = 0.0;
  double place_sigma_m = 0.0;  ///< of x and y, the larger
  int num_motions = 0, num_inliers = 0;
  /// Where straight ahead is in the camera's frame, which needs no turn; zero where nothing went straight.
  Eigen::Vector3d travel_in_camera = Eigen::Vector3d::Zero();
};

/// Planar hand-eye calibration (Guo, Mirzaei, Roumeliotis, ICRA 2012): the place of a camera on a vehicle
/// that moves in a plane, from its motions without scale; 5 degrees of freedom, each step a closed form,
/// reweighted against wrong motions. First the vertical in the camera's frame: about it the camera turns by
/// the odometer's yaw, and perpendicular to it it moves. Then yaw and place: with u the place turned back by
/// the yaw alpha, a motion's direction c is parallel to Rz(-alpha) t_odometer + (R_odometer - I) u, which is
/// linear in cos(alpha), sin(alpha), u; the scale of each motion drops out. The sign of alpha follows from
/// moving forwards.
HandEye solvePlanarHandEye(const std::vector<MotionPair>& motions, const HandEyeOptions& options);

}  // namespace vcharge
