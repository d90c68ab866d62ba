#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "vcharge_core/base/options.h"
#include "vcharge_core/motion/rigid_transform.h"

namespace vcharge {

struct HandEyeOptions {
  VCHARGE_BEGIN_OPTIONS(HandEyeOptions);
  VCHARGE_OPTION(double, odometry_sigma_m, 0.005, positive(), "Deviation of the odometer's translations.");
  VCHARGE_OPTION(double, odometry_sigma_rad, 0.002, positive(), "Deviation of the odometer's turns.");
  VCHARGE_OPTION(double, max_sigma_rad, 0.05, positive(),
                 "Deviation of a rotation that shows a lack of turns.");
  VCHARGE_OPTION(double, max_sigma_m, 0.5, positive(), "Deviation of a position that shows a lack of turns.");
  VCHARGE_END_OPTIONS();
};

/// Motions of vehicle and camera between two instants, previous_from_current.
struct MotionPair {
  RigidTransform vehicle;              ///< planar motion from the odometer
  Eigen::Quaterniond camera_rotation;  ///< rotation in the camera's frame
  Eigen::Vector3d camera_direction;    ///< unit vector along the translation, in the camera's frame
  double rotation_sigma_rad = 0.001;
  double direction_sigma_rad = 0.01;
  bool has_direction = true;  ///< false if the camera hardly moved
  int32_t keyframe = 0;       ///< index of the earlier keyframe
};

enum class HandEyeStatus {
  kOk,
  kTooFewMotions,
  kNoTurn,       ///< roll, pitch and position are not observable on a straight drive
  kNoAgreement,  ///< most motions of camera and odometer contradict each other
};

struct HandEye {
  HandEyeStatus status = HandEyeStatus::kTooFewMotions;
  RigidTransform vehicle_from_camera;  ///< z is zero: planar motion does not determine it
  double tilt_sigma_rad = 0.0;         ///< larger standard deviation of roll and pitch
  double yaw_sigma_rad = 0.0;
  double position_sigma_m = 0.0;  ///< larger standard deviation of x and y
  int num_motions = 0, num_inliers = 0;
  /// Direction of travel in the camera's frame, from straight motions; zero without any.
  Eigen::Vector3d travel_in_camera = Eigen::Vector3d::Zero();
};

/// Planar hand-eye calibration (Guo, Mirzaei, Roumeliotis, ICRA 2012): extrinsics of a camera on a vehicle
/// that moves in a plane, from motions without scale, in 5 degrees of freedom. Each step has a closed form
/// that is reweighted `num_iterations` times against outliers. First, the vertical in the camera's frame:
/// the camera turns about it by the odometer's yaw, and moves perpendicular to it. Second, yaw and position:
/// with u the position rotated back by the yaw alpha, a motion's direction c is parallel to Rz(-alpha)
/// t_odometer + (R_odometer - I) u, which is linear in cos(alpha), sin(alpha), u and independent of the
/// motion's scale. The sign of alpha follows from moving forwards.
HandEye solvePlanarHandEye(const std::vector<MotionPair>& motions, const HandEyeOptions& options,
                           int num_iterations = 30);

}  // namespace vcharge
