#pragma once

#include <vector>

#include "scenes/movers/footprint.h"
#include "vcharge_core/motion/rigid_transform.h"

namespace vcharge {

/// Distance that movers keep from the own car's footprint.
inline constexpr double kOwnClearance_m = 1.5;
/// The same for people who walk up to it.
inline constexpr double kApproachClearance_m = 0.4;
/// The own car can stop at this deceleration, after this reaction time.
inline constexpr double kStop_m_per_s2 = 2.5;
inline constexpr double kReaction_s = 0.5;

/// Where the own car is and will be; movers keep out of its way.
class OwnCar {
 public:
  /// Poses of a drive every kPeriod_s, from time 0; at least one.
  explicit OwnCar(const std::vector<RigidTransform>& world_from_vehicle);
  static constexpr double kPeriod_s = 0.1;

  double duration() const { return kPeriod_s * static_cast<double>(footprints_.size() - 1); }
  double speedAt(double time_s) const;
  const RigidTransform& poseAt(double time_s) const { return poses_[indexAt(time_s)]; }
  /// At the nearest pose.
  const Footprint& footprintAt(double time_s) const { return footprints_[indexAt(time_s)]; }
  /// False if the own car comes nearer than `distance_m` to the outline between now and `horizon_s` later.
  bool keepsClearOf(const Footprint& outline, double time_s, double horizon_s, double distance_m) const;

 private:
  size_t indexAt(double time_s) const;

  std::vector<RigidTransform> poses_;
  std::vector<Footprint> footprints_;
};

}  // namespace vcharge
