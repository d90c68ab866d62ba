#pragma once

#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_core/motion/rigid_transform.h"

namespace vcharge {

/// An upright textured cylinder on the ground of a MovingWorld, in world axes.
struct UprightCylinder {
  Eigen::Vector2d start_m{0.0, 0.0};
  Eigen::Vector2d velocity_m_per_s{0.0, 0.0};
  double radius_m = 0.25;
  double height_m = 1.7;
  Eigen::Vector2d positionAt(double time_s) const { return start_m + time_s * velocity_m_per_s; }
};

/// Textured level ground with upright cylinders, ray-cast exactly, for tests.
struct MovingWorld {
  std::vector<UprightCylinder> cylinders;

  /// CV_8UC1 of the camera's size.
  cv::Mat render(const RigCamera& camera, const RigidTransform& world_from_vehicle, double time_s) const;
};

/// A rig of one 640x400 fisheye camera, `height_m` above the ground at the vehicle's front, that sees ahead.
CameraRig makeFrontRig(double height_m);

}  // namespace vcharge
