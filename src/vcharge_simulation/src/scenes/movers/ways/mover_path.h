#pragma once

#include <vector>

#include "vcharge_simulation/vehicle/drive_path.h"

namespace vcharge {

/// Poses along a path that is driven or walked forwards.
class MoverPath {
 public:
  explicit MoverPath(DrivePath path);

  double length() const { return path_.length(); }
  double curvature(double along_m) const { return path_.curvature(along_m); }
  /// Planar pose, continuous along the path.
  RigidTransform poseAt(double along_m) const;

 private:
  DrivePath path_;
  std::vector<RigidTransform> poses_;  // kSpacing_m apart
};

}  // namespace vcharge
