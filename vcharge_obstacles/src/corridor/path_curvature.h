#pragma once

#include <functional>
#include <optional>

#include "vcharge_core/base/timestamp.h"
#include "vcharge_core/motion/rigid_transform.h"

namespace vcharge {

/// Estimates the curvature of the path that the vehicle drives, from its poses. A standing vehicle keeps the
/// last curvature.
class PathCurvature {
 public:
  /// Pose at a stamp; nothing where it is not known.
  using PoseAt = std::function<std::optional<RigidTransform>(Timestamp)>;

  /// Curvature at a stamp (1/m, positive to the left), from the poses of the last 0.5 m. Poses before a
  /// change of the direction of travel are not used. Depends on the poses up to the stamp, not on when they
  /// arrive.
  double update(Timestamp stamp, const PoseAt& fixed_from_vehicle_at);
  void clear() { curvature_per_m_ = 0.0; }

 private:
  double curvature_per_m_ = 0.0;
};

}  // namespace vcharge
