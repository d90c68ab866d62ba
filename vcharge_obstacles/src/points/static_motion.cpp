#include "points/static_motion.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

namespace vcharge {
namespace {

// A segment shorter than this shows no parallax.
constexpr double kShortSegment_rad = 1e-6;
// Expected directions further than about 85 degrees from the earlier ray do not meet its tangent plane well.
constexpr double kMinCosine = 0.1;

Eigen::Matrix<double, 2, 3> tangentsOf(const Eigen::Vector3d& ray) {
  const Eigen::Vector3d other = std::abs(ray.z()) < 0.9 ? Eigen::Vector3d::UnitZ() : Eigen::Vector3d::UnitX();
  const Eigen::Vector3d first = ray.cross(other).normalized();
  Eigen::Matrix<double, 2, 3> tangents;
  tangents.row(0) = first.transpose();
  tangents.row(1) = ray.cross(first).transpose();
  return tangents;
}

}  // namespace

StaticResidual compareWithStatic(const FollowedPoint& point, const RigidTransform& before_from_now,
                                 double min_inverse_per_m, double max_inverse_per_m) {
  StaticResidual result;
  result.tangents = tangentsOf(point.ray_before);
  const Eigen::Vector3d rotated = before_from_now.rotation() * point.ray_now;
  // Direction, up to its length, of the point at an inverse range.
  const auto directionAt = [&](double inverse_per_m) {
    return Eigen::Vector3d(rotated + inverse_per_m * before_from_now.translation());
  };
  const Eigen::Vector3d far = directionAt(min_inverse_per_m);
  Eigen::Vector3d near = directionAt(max_inverse_per_m);
  if (far.dot(point.ray_before) < kMinCosine * far.norm()) {
    return result;
  }
  double near_inverse_per_m = max_inverse_per_m;
  if (near.dot(point.ray_before) < kMinCosine * near.norm()) {
    // Shortens the segment to the part before the earlier camera, which contains its far end.
    double front = min_inverse_per_m, behind = max_inverse_per_m;
    for (int step = 0; step < 30; ++step) {
      const double middle = 0.5 * (front + behind);
      const Eigen::Vector3d direction = directionAt(middle);
      (direction.dot(point.ray_before) < kMinCosine * direction.norm() ? behind : front) = middle;
    }
    near_inverse_per_m = front;
    near = directionAt(front);
  }
  const auto projected = [&](const Eigen::Vector3d& direction) {
    return Eigen::Vector2d(result.tangents * direction / point.ray_before.dot(direction));
  };
  const Eigen::Vector2d from = projected(far), to = projected(near);
  const Eigen::Vector2d along = to - from;
  double fraction = 0.0;
  if (along.norm() > kShortSegment_rad) {
    fraction = std::clamp(-from.dot(along) / along.squaredNorm(), 0.0, 1.0);
    if (fraction > 0.0 && fraction < 1.0) {
      result.normal = Eigen::Vector2d(-along.y(), along.x()).normalized();
    }
  }
  const Eigen::Vector2d nearest = from + fraction * along;
  // The inverse range is a projective function of the position on the segment.
  const double far_depth = point.ray_before.dot(far), near_depth = point.ray_before.dot(near);
  const double weight = fraction * far_depth / (fraction * far_depth + (1.0 - fraction) * near_depth);
  result.inverse_range_per_m = min_inverse_per_m + weight * (near_inverse_per_m - min_inverse_per_m);
  result.residual_rad = -nearest;
  result.is_valid = true;
  return result;
}

}  // namespace vcharge
