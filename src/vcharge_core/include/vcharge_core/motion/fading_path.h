#pragma once

#include <limits>
#include <optional>

#include "vcharge_core/motion/rigid_transform.h"

namespace vcharge {

/// Weights for a mean of images taken while driving, in which each image counts as much as the path
/// driven since the one before, and fades as the vehicle drives and turns on. Deterministic; not thread safe.
class FadingPath {
 public:
  /// Images count less by a factor of e after a path of `fade_m` or a turn of `fade_rad`.
  explicit FadingPath(double fade_m, double fade_rad = std::numeric_limits<double>::infinity())
      : fade_m_(fade_m), fade_rad_(fade_rad) {}

  /// Goes on to the pose of the next image, and returns its share of the mean: 1 before the first motion,
  /// then 0 for each image without motion. One that does not count fades the others only, and has no share.
  double moveTo(const RigidTransform& fixed_from_body, bool counts = true);
  /// Path that the mean covers, up to about `fade_m`.
  double length_m() const { return length_m_; }
  /// Forgets all images; call it when poses have jumped.
  void clear();

 private:
  double fade_m_, fade_rad_;
  double length_m_ = 0.0;
  std::optional<RigidTransform> fixed_from_last_;
};

}  // namespace vcharge
