#pragma once

#include <cmath>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "vcharge_core/motion/cross_matrix.h"
#include "vcharge_geometry/solvers/point_match.h"
#include "vcharge_geometry/solvers/ray_match.h"
#include "vcharge_geometry/solvers/rotation_translation.h"

namespace vcharge {

// Angular errors of viewing rays, with Jacobians over [dt, dphi] of a transform target_from_source in the
// target frame: t = t_hat + dt, R = Exp(dphi) R_hat.

/// Geometry of both rays of a match and the baseline between the cameras, in the previous frame.
struct EpipolarGeometry {
  Eigen::Vector3d arm;              ///< the current camera's centre, rotated into the previous frame
  Eigen::Vector3d current;          ///< direction of the current ray
  Eigen::Vector3d baseline;         ///< from the previous camera's centre to the current one's
  Eigen::Vector3d across;           ///< previous x current direction
  Eigen::Vector3d current_normal;   ///< baseline x current
  Eigen::Vector3d previous_normal;  ///< baseline x previous
  double normals_squared;

  EpipolarGeometry(const RayMatch& rays, const RotationTranslation& previous_from_current)
      : arm(previous_from_current.rotation * rays.current.origin_m),
        current(previous_from_current.rotation * rays.current.direction),
        baseline(arm + previous_from_current.translation_m - rays.previous.origin_m),
        across(rays.previous.direction.cross(current)),
        current_normal(baseline.cross(current)),
        previous_normal(baseline.cross(rays.previous.direction)),
        normals_squared(current_normal.squaredNorm() + previous_normal.squaredNorm()) {}

  /// False without a baseline: the epipolar plane is undefined, and the rays should be parallel.
  bool hasBaseline() const { return normals_squared > 1e-18; }
};

/// Signed angle (radians) by which each of two rays misses a common epipolar plane, in Sampson's
/// approximation: b . (q x q') / sqrt(|b x q'|^2 + |b x q|^2), where b is the baseline. Its standard
/// deviation is that of a ray's direction.
inline double epipolarAngle(const EpipolarGeometry& geometry) {
  return geometry.baseline.dot(geometry.across) / std::sqrt(geometry.normals_squared);
}

/// Squared epipolarAngle(). Without a baseline, half the squared angle between the rays. Infinite if the rays
/// meet behind a camera although their parallax clearly exceeds the errors (3 max_error_rad).
inline double squaredEpipolarAngle(const RayMatch& rays, const RotationTranslation& previous_from_current,
                                   double max_error_rad) {
  const EpipolarGeometry geometry(rays, previous_from_current);
  const double across_squared = geometry.across.squaredNorm();
  if (!geometry.hasBaseline()) {
    return 0.5 * across_squared;
  }
  // The signs of the depths are those of these products.
  if ((geometry.current_normal.dot(geometry.across) < 0.0 ||
       geometry.previous_normal.dot(geometry.across) < 0.0) &&
      across_squared > 9.0 * max_error_rad * max_error_rad) {
    return INFINITY;
  }
  const double triple = geometry.baseline.dot(geometry.across);
  return triple * triple / geometry.normals_squared;
}

/// epipolarAngle() and its Jacobian; requires a baseline.
inline double epipolarAngleWithJacobian(const EpipolarGeometry& geometry, const Eigen::Vector3d& previous,
                                        Eigen::Matrix<double, 1, 6>* jacobian) {
  const double inverse_norm = 1.0 / std::sqrt(geometry.normals_squared);
  const double angle = geometry.baseline.dot(geometry.across) * inverse_norm;
  // Derivatives of the triple product and of half the squared norm.
  const Eigen::Vector3d triple_by_turn =
      geometry.arm.cross(geometry.across) + geometry.current.cross(geometry.previous_normal);
  const Eigen::Vector3d norm_by_shift =
      geometry.current.cross(geometry.current_normal) + previous.cross(geometry.previous_normal);
  const Eigen::Vector3d norm_by_turn =
      geometry.arm.cross(norm_by_shift) +
      geometry.current.cross(geometry.current_normal.cross(geometry.baseline));
  const double factor = angle * inverse_norm;
  jacobian->head<3>() = inverse_norm * (geometry.across - factor * norm_by_shift).transpose();
  jacobian->tail<3>() = inverse_norm * (triple_by_turn - factor * norm_by_turn).transpose();
  return angle;
}

/// Cross product of the ray's direction and the direction to the point, in the map frame; its length is the
/// sine of the angle between them. Optional Jacobian over [dt, dphi] of map_from_rig.
inline Eigen::Vector3d pointingError(const PointMatch& match, const RotationTranslation& map_from_rig,
                                     Eigen::Matrix<double, 3, 6>* jacobian = nullptr) {
  const Eigen::Vector3d direction = map_from_rig.rotation * match.ray.direction;
  const Eigen::Vector3d arm = map_from_rig.rotation * match.ray.origin_m;
  const Eigen::Vector3d to_point = match.point_m - map_from_rig.translation_m - arm;
  const double inverse_range = 1.0 / to_point.norm();
  const Eigen::Vector3d unit = inverse_range * to_point;
  if (jacobian != nullptr) {
    const Eigen::Matrix3d direction_cross = crossMatrix(direction);
    const Eigen::Matrix3d by_point =
        inverse_range * direction_cross * (Eigen::Matrix3d::Identity() - unit * unit.transpose());
    jacobian->leftCols<3>() = -by_point;
    jacobian->rightCols<3>() = by_point * crossMatrix(arm) + crossMatrix(unit) * direction_cross;
  }
  return direction.cross(unit);
}

/// Squared sine of the angle between a ray and its point; infinite if the point lies behind the camera.
inline double squaredPointingError(const PointMatch& match, const RotationTranslation& map_from_rig) {
  const Eigen::Vector3d to_point =
      map_from_rig.rotation.transpose() * (match.point_m - map_from_rig.translation_m) - match.ray.origin_m;
  if (to_point.dot(match.ray.direction) <= 0.0) {
    return INFINITY;
  }
  return to_point.cross(match.ray.direction).squaredNorm() / to_point.squaredNorm();
}

}  // namespace vcharge
