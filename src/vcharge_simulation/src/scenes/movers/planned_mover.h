#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "scenes/movers/ways/mover_path.h"
#include "scenes/movers/ways/speed_schedule.h"
#include "vcharge_simulation/scenes/scene.h"

namespace vcharge {

/// What a mover is and when it is where.
struct PlannedMover {
  ObjectClass object_class = ObjectClass::kAdult;
  uint32_t look = 0;                     ///< selects clothes, proportions or car and paint
  int car_shape = 0;                     ///< index into carShapes()
  double size = 1.0;                     ///< height of a person relative to an adult's
  double length_m = 0.0, width_m = 0.0;  ///< of the footprint; a circle if the length is zero
  double height_m = 0.0;
  double middle_m = 0.0;  ///< the middle is this far ahead of the point that follows the path
  double ground_z_m = 0.0;
  double start_m = 0.0;  ///< position on the path at time 0 of the schedule
  std::shared_ptr<const MoverPath> path;
  std::shared_ptr<const SpeedSchedule> schedule;

  /// Pose of the middle on the ground.
  RigidTransform poseAt(double along_m) const;
  std::vector<Eigen::Vector2d> outlineAt(double along_m) const;
  /// State at a time since the start of the drive.
  MoverState stateAt(double time_s) const;
};

}  // namespace vcharge
