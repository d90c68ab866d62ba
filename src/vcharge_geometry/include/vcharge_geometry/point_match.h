#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "vcharge_core/rigid_transform.h"
#include "vcharge_geometry/pluecker_line.h"

namespace vcharge {

/// Where a ray of the rig meets a known point of the map.
struct PointMatch {
  Ray ray;                  ///< in the frame of the rig
  Eigen::Vector3d point_m;  ///< in the frame of the map
};

/// A pose of the rig in the map: map_from_rig.
struct RigPose {
  Eigen::Matrix3d rotation;
  Eigen::Vector3d translation_m;

  RigidTransform transform() const { return RigidTransform(Eigen::Quaterniond(rotation), translation_m); }
};

/// Axes of a triangle: along its first side, in its plane, and normal to it. False where it has no area.
inline bool triangleAxes(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                         Eigen::Matrix3d* axes) {
  const Eigen::Vector3d side = b - a;
  const Eigen::Vector3d other = c - a;
  const Eigen::Vector3d normal = side.cross(other);
  const double side_squared = side.squaredNorm();
  const double normal_squared = normal.squaredNorm();
  if (!(normal_squared > 1e-20 * side_squared * other.squaredNorm())) {
    return false;
  }
  axes->col(0) = side / std::sqrt(side_squared);
  axes->col(2) = normal / std::sqrt(normal_squared);
  axes->col(1) = axes->col(2).cross(axes->col(0));
  return true;
}

}  // namespace vcharge
