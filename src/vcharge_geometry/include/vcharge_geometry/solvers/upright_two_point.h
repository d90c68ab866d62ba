#pragma once

#include <array>
#include <cmath>

#include "vcharge_geometry/solvers/point_match.h"
#include "vcharge_geometry/solvers/polynomial.h"
#include "vcharge_geometry/solvers/solver_status.h"

namespace vcharge {

/// Pose of a generalized camera with known roll and pitch from two points. For a single camera: Kukelova,
/// Bujnak, Pajdla, "Closed-form solutions to minimal absolute pose problems with known vertical direction",
/// ACCV 2010. For rigs: Sweeney et al., "Solving for relative pose with a partially known rotation is a
/// quadratic eigenvalue problem", 3DV 2014, treats the general case.
/// The rays are given in a rig frame whose z axis is vertical like the map's: X_i = R_z(yaw)(o_i + lambda_i
/// d_i) + t. The difference of both equations does not depend on the yaw in its height, which is linear in
/// the lambdas, nor in its horizontal length, which is quadratic: intersecting a line and a quadric gives at
/// most 2 poses. Both points must lie in front of their cameras. Two horizontal rays leave the depths
/// undetermined: kDegenerate.
inline SolverStatus solveUprightTwoPoint(const std::array<PointMatch, 2>& matches,
                                         FixedVector<RotationTranslation, 2>* poses) {
  poses->clear();
  const Ray& first = matches[0].ray;
  const Ray& second = matches[1].ray;
  const Eigen::Vector3d points = matches[0].point_m - matches[1].point_m;
  const Eigen::Vector3d origins = first.origin_m - second.origin_m;
  const double first_z = first.direction.z();
  const double second_z = second.direction.z();
  const double norm_squared = first_z * first_z + second_z * second_z;
  const double horizontal_squared = points.x() * points.x() + points.y() * points.y();
  if (!std::isfinite(norm_squared + horizontal_squared + points.z() + origins.sum() + first.direction.sum() +
                     second.direction.sum())) {
    return SolverStatus::kNotFinite;
  }
  if (norm_squared < 1e-12 || horizontal_squared <= 1e-24 * points.z() * points.z()) {
    return SolverStatus::kDegenerate;
  }
  // Depths on the line of equal heights: nearest_i + step * along_i.
  const double height = (points.z() - origins.z()) / norm_squared;
  const double first_nearest = height * first_z;
  const double second_nearest = -height * second_z;
  // Horizontal difference in the rig frame: base + step * slope.
  const double base_x =
      origins.x() + first_nearest * first.direction.x() - second_nearest * second.direction.x();
  const double base_y =
      origins.y() + first_nearest * first.direction.y() - second_nearest * second.direction.y();
  const double slope_x = second_z * first.direction.x() - first_z * second.direction.x();
  const double slope_y = second_z * first.direction.y() - first_z * second.direction.y();
  const double slope_squared = slope_x * slope_x + slope_y * slope_y;
  if (slope_squared < 1e-24) {
    // Parallel rays: any step along both gives the same difference.
    return SolverStatus::kDegenerate;
  }
  for (const double step : quadraticRoots(slope_squared, 2.0 * (base_x * slope_x + base_y * slope_y),
                                          base_x * base_x + base_y * base_y - horizontal_squared)) {
    const double first_depth = first_nearest + step * second_z;
    const double second_depth = second_nearest + step * first_z;
    if (!(first_depth > 0.0 && second_depth > 0.0)) {
      continue;
    }
    const double x = base_x + step * slope_x;
    const double y = base_y + step * slope_y;
    const double scale = 1.0 / std::sqrt((x * x + y * y) * horizontal_squared);
    const double cosine = scale * (x * points.x() + y * points.y());
    const double sine = scale * (x * points.y() - y * points.x());
    RotationTranslation pose;
    pose.rotation << cosine, -sine, 0.0, sine, cosine, 0.0, 0.0, 0.0, 1.0;
    pose.translation_m =
        matches[0].point_m - pose.rotation * (first.origin_m + first_depth * first.direction);
    poses->push_back(pose);
  }
  return SolverStatus::kOk;
}

}  // namespace vcharge
