#include "points/rotation_correction.h"

#include <cmath>

#include <Eigen/Cholesky>

#include "vcharge_core/motion/cross_matrix.h"

namespace vcharge {

RotationEquation rotationEquationOf(const StaticResidual& found, const Eigen::Vector3d& ray_before,
                                    double part, const Eigen::Matrix3d& vehicle_from_camera,
                                    double sigma_rad) {
  RotationEquation equation;
  equation.by_rotation = part * found.tangents * crossMatrix(ray_before) * vehicle_from_camera.transpose();
  equation.residual_rad = found.residual_rad;
  equation.sigma_rad = sigma_rad;
  equation.has_second = found.normal.isZero();
  if (!equation.has_second) {
    equation.residual_rad = {found.normal.dot(found.residual_rad), 0.0};
    equation.by_rotation.row(0) = found.normal.transpose() * equation.by_rotation;
  }
  return equation;
}

Eigen::Vector3d correctRotation(const std::vector<RotationEquation>& equations, double sigma_rad) {
  constexpr int kNumSteps = 6;
  // The kernel narrows from this number of standard deviations, so that a wrong start does not hide static
  // points.
  constexpr double kFirstScale = 8.0, kLastScale = 2.0;
  Eigen::Vector3d rotation = Eigen::Vector3d::Zero();
  for (int step = 0; step < kNumSteps; ++step) {
    const double scale = kFirstScale + (kLastScale - kFirstScale) * step / (kNumSteps - 1);
    Eigen::Matrix3d information = Eigen::Matrix3d::Identity() / (sigma_rad * sigma_rad);
    Eigen::Vector3d vector = Eigen::Vector3d::Zero();
    for (const RotationEquation& equation : equations) {
      const Eigen::Vector2d left = equation.residual_rad - equation.by_rotation * rotation;
      const double squared = (equation.has_second ? left.squaredNorm() : left.x() * left.x()) /
                             (scale * scale * equation.sigma_rad * equation.sigma_rad);
      const double weight = 1.0 / ((1.0 + squared) * equation.sigma_rad * equation.sigma_rad);
      for (int row = 0; row < (equation.has_second ? 2 : 1); ++row) {
        const Eigen::Vector3d jacobian = equation.by_rotation.row(row).transpose();
        information += weight * jacobian * jacobian.transpose();
        vector += weight * equation.residual_rad[row] * jacobian;
      }
    }
    rotation = information.ldlt().solve(vector);
  }
  return rotation;
}

}  // namespace vcharge
