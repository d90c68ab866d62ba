#pragma once

#include <vector>

#include "vcharge_core/motion/rigid_transform.h"

namespace vcharge {

/// world_from_vehicle around the stamp of an image, in steps of one millisecond.
class MotionWindow {
 public:
  /// The vehicle stands still.
  explicit MotionWindow(const RigidTransform& world_from_vehicle) : poses_(1, world_from_vehicle) {}
  /// One pose per millisecond, the middle one at the stamp. Throws std::logic_error unless their number is
  /// odd.
  explicit MotionWindow(std::vector<RigidTransform> poses);

  /// Pose at a time after the stamp, interpolated between whole milliseconds. Throws std::logic_error outside
  /// the window, except for a vehicle that stands still.
  RigidTransform at(double since_stamp_s) const;

 private:
  std::vector<RigidTransform> poses_;
};

}  // namespace vcharge
