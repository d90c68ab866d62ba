#include "scenes/movers/ways/mover_path.h"
#include "vcharge_core/motion/vehicle_rates.h"

#include <algorithm>
#include <utility>

namespace vcharge {

namespace {

constexpr double kSpacing_m = 0.05;

}  // namespace

MoverPath::MoverPath(DrivePath path) : path_(std::move(path)) {
  poses_.push_back(path_.worldFromStart());
  for (double along_m = 0.0; along_m < path_.length(); along_m += kSpacing_m) {
    poses_.push_back(poses_.back() *
                     arcMotion(kSpacing_m, path_.heading(along_m + kSpacing_m) - path_.heading(along_m)));
  }
}

RigidTransform MoverPath::poseAt(double along_m) const {
  const auto index = std::min(static_cast<size_t>(std::max(0.0, along_m / kSpacing_m)), poses_.size() - 1);
  const double from_m = kSpacing_m * static_cast<double>(index);
  return poses_[index] * arcMotion(along_m - from_m, path_.heading(along_m) - path_.heading(from_m));
}

}  // namespace vcharge
