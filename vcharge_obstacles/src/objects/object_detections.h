#pragma once

#include <vector>

#include <Eigen/Core>

#include "contacts/ground_contact.h"
#include "vcharge_core/motion/rigid_transform.h"

namespace vcharge {

/// A point that no static point explains.
struct MovingPoint {
  Eigen::Vector3d ray_in_vehicle;  ///< unit, now
  Eigen::Vector3d ray_before;      ///< unit, in the earlier vehicle's axes
  RigidTransform before_from_now;  ///< motion of the vehicle since
  double age_s = 0.0;              ///< time between the two rays
  double sigma_rad = 0.0;          ///< of a ray
};

/// What one camera measures of an object that moves.
struct ObjectDetection {
  Eigen::Vector2d position_m{0.0, 0.0};        ///< contact in the middle of the visible side, vehicle frame
  Eigen::Vector2d velocity_m_per_s{0.0, 0.0};  ///< over the ground, along the vehicle's axes
  Eigen::Matrix4d covariance = Eigen::Matrix4d::Identity();  ///< of position and velocity
  Eigen::Vector2d left_m{0.0, 0.0}, right_m{0.0, 0.0};       ///< ends of the visible side on the ground
  Eigen::Vector2d away{1.0, 0.0};                            ///< unit direction from the camera
  double height_m = 0.0;                                     ///< highest point
  int num_points = 0;
  bool has_velocity = true;    ///< otherwise the velocity is 0 with a wide covariance
  double drift_m_per_s = 0.0;  ///< speed at which something static may seem to move, without a velocity
};

/// Groups moving points by where they stand on the ground, and fits a position and a velocity to each group.
/// Groups that lie flat on the ground, as shadows do, are left out.
std::vector<ObjectDetection> detectObjects(const std::vector<MovingPoint>& points,
                                           const GroundContact& contact,
                                           const Eigen::Vector3d& camera_in_vehicle_m);

}  // namespace vcharge
