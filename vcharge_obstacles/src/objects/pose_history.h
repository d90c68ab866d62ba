#pragma once

#include <algorithm>
#include <deque>
#include <vector>

#include "vcharge_core/base/timestamp.h"
#include "vcharge_core/frames/frame_assembler.h"
#include "vcharge_core/motion/rigid_transform.h"

namespace vcharge {

/// Poses of the vehicle at the last stamps.
class PoseHistory {
 public:
  struct Pose {
    Timestamp stamp;
    RigidTransform odom_from_vehicle;
  };
  /// Adds the newest pose, and drops those that are older than this.
  void add(Timestamp stamp, const RigidTransform& odom_from_vehicle, double max_age_s) {
    poses_.push_back({stamp, odom_from_vehicle});
    while (toSeconds(stamp - poses_.front().stamp) > max_age_s) {
      poses_.pop_front();
    }
  }
  void correct(const std::vector<CorrectedPose>& corrections) {
    for (Pose& pose : poses_) {
      if (const CorrectedPose* corrected = correctionAt(corrections, pose.stamp)) {
        pose.odom_from_vehicle = corrected->odom_from_vehicle;
      }
    }
  }
  /// Null if the stamp has no pose.
  const Pose* at(Timestamp stamp) const {
    const auto found =
        std::find_if(poses_.begin(), poses_.end(), [&](const Pose& pose) { return pose.stamp == stamp; });
    return found == poses_.end() ? nullptr : &*found;
  }
  const Pose& first() const { return poses_.front(); }
  const Pose& now() const { return poses_.back(); }
  /// Motion of the vehicle since another pose.
  RigidTransform beforeFromNow(const Pose& before) const {
    return before.odom_from_vehicle.inverse() * now().odom_from_vehicle;
  }

 private:
  std::deque<Pose> poses_;
};

}  // namespace vcharge
