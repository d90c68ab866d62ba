#pragma once

#include <string>

#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_core/motion/rigid_transform.h"

namespace vcharge::testing {

/// vehicle_from_camera of a forward-looking camera that is rotated by these angles.
inline RigidTransform makeExtrinsics(double yaw_rad, double pitch_rad, double roll_rad,
                                     const Eigen::Vector3d& position_m) {
  Eigen::Matrix3d forward_from_optical;
  forward_from_optical << 0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, -1.0, 0.0;
  return RigidTransform(
      rotationFromYawPitchRoll(yaw_rad, pitch_rad, roll_rad) * Eigen::Quaterniond(forward_from_optical),
      position_m);
}

/// An equidistant fisheye camera of 640x400 pixels.
inline RigCamera makeFisheyeCamera(const std::string& name, double focal_px,
                                   const RigidTransform& vehicle_from_camera) {
  KannalaBrandtCamera::Parameters parameters;
  parameters << focal_px, focal_px, 319.5, 199.5, 0.0, 0.0, 0.0, 0.0;
  RigCamera camera{name, "camera_" + name + "_optical", cv::Size(640, 400), KannalaBrandtCamera(parameters)};
  camera.field_of_view_rad = 3.0;
  camera.vehicle_from_camera = vehicle_from_camera;
  return camera;
}

}  // namespace vcharge::testing
