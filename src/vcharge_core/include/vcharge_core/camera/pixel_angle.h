#pragma once

#include <cmath>

#include <Eigen/Geometry>

#include "vcharge_core/camera/camera_rig.h"

namespace vcharge {

/// Angle in radians between the rays of two neighbouring pixels in the middle of the image; 0 if the camera
/// has no rays there.
inline double radiansPerPixel(const RigCamera& camera) {
  const Eigen::Vector2d middle(0.5 * camera.image_size_px.width, 0.5 * camera.image_size_px.height);
  Eigen::Vector3d ray, next;
  if (!camera.model.unproject(middle, &ray) ||
      !camera.model.unproject(middle + Eigen::Vector2d::UnitX(), &next)) {
    return 0.0;
  }
  return std::atan2(ray.cross(next).norm(), ray.dot(next));
}

}  // namespace vcharge
