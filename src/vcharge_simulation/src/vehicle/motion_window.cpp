#include "vcharge_simulation/vehicle/motion_window.h"

#include <cmath>
#include <utility>

#include "vcharge_core/base/error.h"

namespace vcharge {

MotionWindow::MotionWindow(std::vector<RigidTransform> poses) : poses_(std::move(poses)) {
  check(poses_.size() % 2 == 1, "MotionWindow: the number of poses must be odd");
}

RigidTransform MotionWindow::at(double since_stamp_s) const {
  if (poses_.size() == 1) {
    return poses_.front();
  }
  const size_t middle = poses_.size() / 2;
  const double index = 1000.0 * since_stamp_s + static_cast<double>(middle);
  const double before = std::floor(index);
  check(before >= 0.0 && index <= static_cast<double>(poses_.size() - 1),
        "MotionWindow: the time is outside the window");
  const RigidTransform& pose = poses_[static_cast<size_t>(before)];
  return index == before ? pose : interpolate(pose, poses_[static_cast<size_t>(before) + 1], index - before);
}

}  // namespace vcharge
