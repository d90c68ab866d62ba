#include "vcharge_obstacles/corridor.h"

namespace vcharge {

std::vector<TrackedObject> movedObjects(const std::vector<TrackedObject>& objects, double time_s) {
  if (time_s > kObjectLife_s) {
    return {};
  }
  std::vector<TrackedObject> moved = objects;
  for (TrackedObject& object : moved) {
    const Eigen::Vector3d step_m = time_s * object.velocity_m_per_s;
    object.frame_from_object =
        RigidTransform(object.frame_from_object.rotation(), object.frame_from_object.translation() + step_m);
    for (Eigen::Vector2d& corner_m : object.footprint_m) {
      corner_m += step_m.head<2>();
    }
  }
  return moved;
}

std::vector<TrackedObject> transformed(const RigidTransform& target_from_source,
                                       const std::vector<TrackedObject>& objects) {
  std::vector<TrackedObject> result = objects;
  const Eigen::Matrix3d rotation = target_from_source.rotationMatrix();
  Eigen::Matrix<double, 6, 6> turn = Eigen::Matrix<double, 6, 6>::Zero();
  turn.topLeftCorner<3, 3>() = turn.bottomRightCorner<3, 3>() = rotation;
  for (TrackedObject& object : result) {
    object.frame_from_object = target_from_source * object.frame_from_object;
    object.velocity_m_per_s = rotation * object.velocity_m_per_s;
    object.covariance = turn * object.covariance * turn.transpose();
    const double base_z_m = object.base_z_m;
    for (Eigen::Vector2d& corner_m : object.footprint_m) {
      corner_m = (target_from_source * Eigen::Vector3d(corner_m.x(), corner_m.y(), base_z_m)).head<2>();
    }
    object.base_z_m += target_from_source.translation().z();
  }
  return result;
}

}  // namespace vcharge
