#pragma once

#include <cmath>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "vcharge_core/motion/cross_matrix.h"

namespace vcharge {

/// Derivative of Exp(dphi) q with respect to dphi at 0; q is x, y, z, w.
inline Eigen::Matrix<double, 4, 3> quaternionByTurn(const double* q) {
  const Eigen::Map<const Eigen::Vector3d> vector(q);
  Eigen::Matrix<double, 4, 3> jacobian;
  jacobian.topRows<3>() = 0.5 * (q[3] * Eigen::Matrix3d::Identity() - crossMatrix(vector));
  jacobian.bottomRows<1>() = -0.5 * vector.transpose();
  return jacobian;
}

/// Pseudoinverse of quaternionByTurn(): converts a derivative by dphi to one by the quaternion, equivalent on
/// the manifold. The columns of quaternionByTurn() are orthogonal with squared length 1/4.
inline Eigen::Matrix<double, 3, 4> turnByQuaternion(const double* q) {
  return 4.0 * quaternionByTurn(q).transpose();
}

/// Log(Exp(d) Exp(phi)) = phi + leftJacobianInverse(phi) d to first order in d.
inline Eigen::Matrix3d leftJacobianInverse(const Eigen::Vector3d& phi) {
  const double angle = phi.norm();
  const Eigen::Matrix3d cross = crossMatrix(phi);
  // (1 - (angle / 2) cot(angle / 2)) / angle^2 = 1/12 + angle^2 / 720 + ...
  const double factor = angle < 1e-3 ? 1.0 / 12.0 + angle * angle / 720.0
                                     : (1.0 - 0.5 * angle / std::tan(0.5 * angle)) / (angle * angle);
  return Eigen::Matrix3d::Identity() - 0.5 * cross + factor * cross * cross;
}

}  // namespace vcharge
