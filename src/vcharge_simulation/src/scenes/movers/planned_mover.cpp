#include "scenes/movers/planned_mover.h"

#include "scenes/scene_parts.h"

namespace vcharge {

RigidTransform PlannedMover::poseAt(double along_m) const {
  const RigidTransform middle = path->poseAt(start_m + along_m) * RigidTransform::planar(middle_m, 0.0, 0.0);
  return RigidTransform(middle.rotation(), middle.translation() + Eigen::Vector3d(0.0, 0.0, ground_z_m));
}

std::vector<Eigen::Vector2d> PlannedMover::outlineAt(double along_m) const {
  const RigidTransform pose = poseAt(along_m);
  const Eigen::Vector3d& middle = pose.translation();
  return length_m > 0.0 ? orientedRectangle(middle.x(), middle.y(), yawOfRotation(pose.rotation()),
                                            -0.5 * length_m, 0.5 * length_m, 0.5 * width_m)
                        : circleAround(middle.x(), middle.y(), 0.5 * width_m);
}

MoverState PlannedMover::stateAt(double time_s) const {
  const auto [along_m, speed_m_per_s] = schedule->at(time_s);
  MoverState state;
  state.world_from_mover = poseAt(along_m);
  // The middle swings out in curves, since another point follows the path.
  state.velocity_m_per_s =
      state.world_from_mover.rotation() *
      (speed_m_per_s * Eigen::Vector3d(1.0, middle_m * path->curvature(start_m + along_m), 0.0));
  state.is_standing = speed_m_per_s == 0.0;
  const bool is_person = object_class == ObjectClass::kAdult || object_class == ObjectClass::kChild;
  state.obstacle = {is_person ? "pedestrian" : nameOf(object_class), outlineAt(along_m), ground_z_m,
                    ground_z_m + height_m};
  return state;
}

}  // namespace vcharge
