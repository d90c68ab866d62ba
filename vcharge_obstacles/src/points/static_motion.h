#pragma once

#include <Eigen/Core>

#include "vcharge_core/motion/rigid_transform.h"

namespace vcharge {

/// A point followed in one camera: its unit rays in the current image and in an earlier one.
struct FollowedPoint {
  Eigen::Vector3d ray_now, ray_before;
};

/// Smallest motion of a followed point that no static point explains, in the tangent plane of the earlier
/// ray.
struct StaticResidual {
  /// Observed minus nearest expected direction, in radians, along two axes of the tangent plane.
  Eigen::Vector2d residual_rad{0.0, 0.0};
  Eigen::Matrix<double, 2, 3> tangents;  ///< rows: the two axes, in the earlier camera
  /// Unit vector across the curve of static points, if the nearest one lies inside of it. At its ends
  /// (nearest and farthest allowed point, or without parallax) the residual counts in all directions, and
  /// this is zero.
  Eigen::Vector2d normal{0.0, 0.0};
  double inverse_range_per_m = 0.0;  ///< of the nearest expected point
  bool is_valid = false;             ///< false where the expected point lies behind the earlier camera
};

/// Compares a followed point with all static points on its current ray at inverse ranges from
/// `min_inverse_per_m` (the ground, beyond which nothing is visible; 0: infinity) to `max_inverse_per_m`:
/// their images in the earlier camera lie on a segment of an epipolar line. Range is measured along the ray.
StaticResidual compareWithStatic(const FollowedPoint& point, const RigidTransform& before_from_now,
                                 double min_inverse_per_m, double max_inverse_per_m);

}  // namespace vcharge
