#include "vcharge_core/motion/fading_path.h"

#include <algorithm>
#include <cmath>

namespace vcharge {
namespace {

// The path to one image counts up to this, so that none outweighs all others after a gap.
constexpr double kMaxStep_m = 1.0;

}  // namespace

double FadingPath::moveTo(const RigidTransform& fixed_from_body, bool counts) {
  double step_m = 0.0;
  if (fixed_from_last_) {
    const RigidTransform motion = fixed_from_last_->inverse() * fixed_from_body;
    step_m = std::min(kMaxStep_m, motion.translation().norm());
    const double turn_rad = motion.rotation().angularDistance(Eigen::Quaterniond::Identity());
    length_m_ = length_m_ * std::exp(-step_m / fade_m_ - turn_rad / fade_rad_) + (counts ? step_m : 0.0);
  }
  fixed_from_last_ = fixed_from_body;
  if (!counts) {
    return 0.0;
  }
  return length_m_ > 0.0 ? step_m / length_m_ : 1.0;
}

void FadingPath::clear() {
  length_m_ = 0.0;
  fixed_from_last_.reset();
}

}  // namespace vcharge
