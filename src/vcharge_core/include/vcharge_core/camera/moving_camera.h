#pragma once

#include <Eigen/Core>

#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_core/motion/vehicle_rates.h"

namespace vcharge {

/// A camera of a vehicle that moves while the lines of an image are exposed one after the other. The map may
/// be any frame in which the vehicle's pose is given.
class MovingCamera {
 public:
  /// Pose and motion of the vehicle are those at the frame's stamp. The camera must outlive this object.
  MovingCamera(const RigCamera& camera, const RigidTransform& map_from_vehicle, const ImageMotion& motion);

  /// Whether pixels may be exposed elsewhere than at the frame's stamp.
  bool moves() const;
  /// Pose of the camera at the frame's stamp.
  const RigidTransform& mapFromCamera() const { return map_from_camera_; }
  /// Pose of the camera when it exposed a pixel.
  RigidTransform poseAt(const Eigen::Vector2d& position_px) const;
  /// A point in the camera's frame when the camera exposed it.
  Eigen::Vector3d pointInCamera(const Eigen::Vector3d& point_in_map) const;

 private:
  const RigCamera& camera_;
  const RigidTransform map_from_vehicle_;
  const ImageMotion motion_;
  const RigidTransform map_from_camera_, camera_from_map_;
};

}  // namespace vcharge
