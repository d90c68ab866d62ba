#include "vcharge_core/camera/moving_camera.h"

namespace vcharge {
namespace {

/// The line that sees a point depends on where the line sees it: each iteration divides the error by the
/// ratio of the image's height to what it moves during the readout.
constexpr int kIterations = 2;

}  // namespace

MovingCamera::MovingCamera(const RigCamera& camera, const RigidTransform& map_from_vehicle,
                           const ImageMotion& motion)
    : camera_(camera),
      map_from_vehicle_(map_from_vehicle),
      motion_(motion),
      map_from_camera_(map_from_vehicle * *camera.vehicle_from_camera),
      camera_from_map_(map_from_camera_.inverse()) {}

bool MovingCamera::moves() const {
  return !camera_.timing.isInstant() || motion_.offset_s != 0.0;
}

RigidTransform MovingCamera::poseAt(const Eigen::Vector2d& position_px) const {
  const double time_s = motion_.offset_s + camera_.exposedAt(position_px);
  return time_s == 0.0 ? map_from_camera_
                       : map_from_vehicle_ * motion_.rates.motionAfter(time_s) * *camera_.vehicle_from_camera;
}

Eigen::Vector3d MovingCamera::pointInCamera(const Eigen::Vector3d& point_in_map) const {
  Eigen::Vector3d in_camera = camera_from_map_ * point_in_map;
  Eigen::Vector2d position_px;
  for (int i = 0; moves() && i < kIterations; ++i) {
    if (!camera_.model.project(in_camera, &position_px)) {
      break;
    }
    in_camera = poseAt(position_px).inverse() * point_in_map;
  }
  return in_camera;
}

}  // namespace vcharge
