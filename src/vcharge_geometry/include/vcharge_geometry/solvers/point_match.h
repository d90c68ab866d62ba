#pragma once

#include <cmath>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "vcharge_geometry/solvers/pluecker_line.h"
#include "vcharge_geometry/solvers/rotation_translation.h"

namespace vcharge {

/// Match between a ray of the rig and a known point of the map.
struct PointMatch {
  Ray ray;                  ///< in the rig frame
  Eigen::Vector3d point_m;  ///< in the map frame
  int camera = 0;           ///< any label; used to draw samples across cameras
  double quality = 1.0;     ///< higher for more reliable matches; used to draw samples
};

/// Axes of a triangle: along its first side, in its plane, and normal to it. False if its area is zero.
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
