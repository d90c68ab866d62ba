#pragma once

#include <vector>

#include <Eigen/Core>

#include "points/static_motion.h"

namespace vcharge {

/// A followed point as an equation for a small rotation of the vehicle: residual - by_rotation * rotation is
/// zero for a static point. One or two rows count.
struct RotationEquation {
  Eigen::Vector2d residual_rad;
  Eigen::Matrix<double, 2, 3> by_rotation;
  bool has_second = false;
  double sigma_rad = 0.0;
};

/// The equation of a point by its residual and its earlier ray in the camera's axes. `part`: rotation between
/// its two images, relative to the rotation that is searched.
RotationEquation rotationEquationOf(const StaticResidual& found, const Eigen::Vector3d& ray_before,
                                    double part, const Eigen::Matrix3d& vehicle_from_camera,
                                    double sigma_rad);

/// Rotation of the vehicle (vector in its axes) that wheel odometry did not measure, as of a body that
/// pitches when the car brakes. Robust to points that move, and to many of them: iteratively reweighted least
/// squares with a Cauchy kernel and the prior deviation `sigma_rad` per axis. Zero without equations.
Eigen::Vector3d correctRotation(const std::vector<RotationEquation>& equations, double sigma_rad);

}  // namespace vcharge
