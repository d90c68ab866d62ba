#pragma once

#include <Eigen/Core>

namespace vcharge {

/// The matrix for which crossMatrix(a) * b is the cross product of a and b.
inline Eigen::Matrix3d crossMatrix(const Eigen::Vector3d& v) {
  Eigen::Matrix3d matrix;
  matrix << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return matrix;
}

}  // namespace vcharge
