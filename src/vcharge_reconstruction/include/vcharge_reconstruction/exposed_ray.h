#pragma once

#include <Eigen/Core>

#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_core/motion/vehicle_rates.h"
#include "vcharge_geometry/solvers/pluecker_line.h"

namespace vcharge {

/// Ray of a camera in the vehicle's frame at the frame's stamp, from where the camera was when it exposed the
/// pixel.
inline Ray rayInVehicle(const RigCamera& camera, const Eigen::Vector3d& ray_in_camera,
                        const Eigen::Vector2d& position_px, const ImageMotion& motion) {
  const RigidTransform& vehicle_from_camera = *camera.vehicle_from_camera;
  const Ray ray{vehicle_from_camera.translation(), vehicle_from_camera.rotation() * ray_in_camera};
  const double time_s = motion.offset_s + camera.exposedAt(position_px);
  return time_s == 0.0 ? ray : motion.rates.motionAfter(time_s) * ray;
}

}  // namespace vcharge
