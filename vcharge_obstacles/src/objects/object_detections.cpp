#include "objects/object_detections.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>

#include "vcharge_core/base/quantile.h"

namespace vcharge {
namespace {

// Points of one object are at most this far from the next one, across the view, and pass the camera at speeds
// that differ by at most this, beside their errors.
constexpr double kGap_m = 0.35, kSpeedGap_m_per_s = 1.0, kSpeedGapSigmas = 3.0;
constexpr size_t kMinPoints = 3;
// Lower points may be edges of shadows on the ground, and groups that reach no higher than the second are.
constexpr double kMinPointHeight_m = 0.15, kMinHeight_m = 0.4;
// Errors of contacts are alike in successive images: each counts as this much less certain.
constexpr double kCommonContact = 3.0;
// Velocities of points on outlines are between those of the object and of what is behind it: errors across
// and along the view.
constexpr double kAcross_m_per_s = 0.4, kAlong_m_per_s = 0.8;

// Squared residual, over its variance, of a point that fits the object's motion; least fraction of these.
constexpr double kFitting = 16.0, kMinFitting = 0.45;
// Legs, the lower part of a person, swing by about this speed at the ground.
constexpr double kSwing_m_per_s = 0.8, kSwingingPart = 0.5;

struct PlacedPoint {
  const MovingPoint* point;
  double azimuth_rad;
  double azimuth_rate_rad_per_s;  // seen from the camera, which may move, but not turned with it
  Contact contact;
};

/// Whether two points may belong to one upright object: then they pass at the same azimuth at the same speed,
/// whatever their heights. Contacts are not compared, since a wrong one must not split an object.
bool belongTogether(const PlacedPoint& a, const PlacedPoint& b) {
  const double range_m = std::min(a.contact.range_m, b.contact.range_m);
  const double across_m = range_m * std::abs(std::remainder(a.azimuth_rad - b.azimuth_rad, 2.0 * M_PI));
  const double rate_sigma =
      M_SQRT2 * std::hypot(a.point->sigma_rad / a.point->age_s, b.point->sigma_rad / b.point->age_s);
  const double rate = std::abs(a.azimuth_rate_rad_per_s - b.azimuth_rate_rad_per_s);
  return across_m < kGap_m && rate * range_m < kSpeedGap_m_per_s + kSpeedGapSigmas * rate_sigma * range_m;
}

/// Connected groups of points that belong together.
std::vector<std::vector<PlacedPoint>> groupOf(const std::vector<PlacedPoint>& points) {
  std::vector<bool> is_grouped(points.size(), false);
  std::vector<std::vector<PlacedPoint>> groups;
  for (size_t seed = 0; seed < points.size(); ++seed) {
    if (is_grouped[seed]) {
      continue;
    }
    groups.emplace_back();
    std::vector<size_t> open = {seed};
    is_grouped[seed] = true;
    while (!open.empty()) {
      const size_t current = open.back();
      open.pop_back();
      groups.back().push_back(points[current]);
      for (size_t other = 0; other < points.size(); ++other) {
        if (!is_grouped[other] && belongTogether(points[current], points[other])) {
          is_grouped[other] = true;
          open.push_back(other);
        }
      }
    }
  }
  return groups;
}

/// Velocity over the ground of upright points at known ranges, from their rays now and before: linear in the
/// tangent plane of the earlier ray. Iteratively reweighted least squares.
bool fitVelocity(const std::vector<PlacedPoint>& group, const Eigen::Vector3d& camera_m,
                 ObjectDetection* found, Eigen::Matrix2d* covariance) {
  struct Equation {
    Eigen::Vector2d residual_rad;
    Eigen::Matrix2d by_velocity;
    double sigma_rad;
  };
  std::vector<Equation> equations;
  for (const PlacedPoint& placed : group) {
    const MovingPoint& point = *placed.point;
    const double horizontal = point.ray_in_vehicle.head<2>().norm();
    const Eigen::Vector3d here = camera_m + placed.contact.range_m / horizontal * point.ray_in_vehicle;
    const Eigen::Vector3d seen = point.before_from_now * here - camera_m;
    const double depth_m = seen.dot(point.ray_before);
    if (depth_m < 0.1) {
      continue;
    }
    const Eigen::Vector3d first = point.ray_before.unitOrthogonal();
    Eigen::Matrix<double, 2, 3> tangents;
    tangents.row(0) = first.transpose();
    tangents.row(1) = point.ray_before.cross(first).transpose();
    const Eigen::Matrix3d rotation = point.before_from_now.rotationMatrix();
    const double lower = std::max(0.0, 1.0 - here.z() / (kSwingingPart * found->height_m));
    const double sigma_rad =
        std::hypot(point.sigma_rad * M_SQRT2, kSwing_m_per_s * lower * point.age_s / depth_m);
    // Before, the point was at here - velocity * age.
    equations.push_back(
        {-tangents * seen / depth_m, -point.age_s / depth_m * tangents * rotation.leftCols<2>(), sigma_rad});
  }
  if (equations.size() < 2) {
    return false;
  }
  Eigen::Vector2d velocity = Eigen::Vector2d::Zero();
  Eigen::Matrix2d information = Eigen::Matrix2d::Zero();
  constexpr int kNumSteps = 8;
  for (int step = 0; step < kNumSteps; ++step) {
    // Legs swing by several times the error of a ray.
    const double scale = step == 0 ? 1e3 : 4.0;
    information = 1e-4 * Eigen::Matrix2d::Identity();
    Eigen::Vector2d vector = Eigen::Vector2d::Zero();
    for (const Equation& equation : equations) {
      const Eigen::Vector2d left = equation.residual_rad - equation.by_velocity * velocity;
      const double variance = equation.sigma_rad * equation.sigma_rad;
      const double weight = 1.0 / ((1.0 + left.squaredNorm() / (scale * scale * variance)) * variance);
      information += weight * equation.by_velocity.transpose() * equation.by_velocity;
      vector += weight * equation.by_velocity.transpose() * equation.residual_rad;
    }
    velocity = information.ldlt().solve(vector);
  }
  // The scatter of the points about a rigid motion tells how well it is measured. Points that do not move
  // together are no object.
  double chi_squared = 0.0;
  size_t num_fitting = 0;
  for (const Equation& equation : equations) {
    const double squared = (equation.residual_rad - equation.by_velocity * velocity).squaredNorm() /
                           (equation.sigma_rad * equation.sigma_rad);
    chi_squared += std::min(squared, kFitting * 4.0);
    num_fitting += squared < kFitting ? 1 : 0;
  }
  if (num_fitting < kMinFitting * equations.size() || num_fitting < kMinPoints) {
    return false;
  }
  const double inflation = std::max(1.0, chi_squared / (2.0 * static_cast<double>(equations.size()) - 2.0));
  found->velocity_m_per_s = velocity;
  *covariance = inflation * information.inverse();
  return true;
}

double slopeOf(const Eigen::Vector3d& ray) {
  return ray.z() / ray.head<2>().norm();
}

std::optional<ObjectDetection> fitObject(std::vector<PlacedPoint> group, const GroundContact& ground,
                                         const Eigen::Vector3d& camera_m) {
  if (group.size() < kMinPoints) {
    return std::nullopt;
  }
  // Azimuths relative to the first point, so that they do not wrap.
  double low_rad = 0.0, high_rad = 0.0;
  const double reference_rad = group.front().azimuth_rad;
  std::vector<double> slopes;
  for (const PlacedPoint& placed : group) {
    const double azimuth_rad = std::remainder(placed.azimuth_rad - reference_rad, 2.0 * M_PI);
    low_rad = std::min(low_rad, azimuth_rad);
    high_rad = std::max(high_rad, azimuth_rad);
    slopes.push_back(slopeOf(placed.point->ray_in_vehicle));
  }
  const double middle_slope = quantile(slopes, 0.5), top_slope = quantile(slopes, 0.95);
  const std::optional<Contact> contact =
      ground.below(reference_rad + low_rad, reference_rad + high_rad, middle_slope);
  if (!contact) {
    return std::nullopt;
  }
  const double range_m = contact->range_m, sigma_m = kCommonContact * contact->sigma_m;
  const double height_m = camera_m.z() + range_m * top_slope;
  if (height_m < kMinHeight_m) {
    return std::nullopt;
  }
  const auto groundAt = [&](double azimuth_rad) {
    const double absolute_rad = reference_rad + azimuth_rad;
    return Eigen::Vector2d(camera_m.head<2>() +
                           range_m * Eigen::Vector2d(std::cos(absolute_rad), std::sin(absolute_rad)));
  };
  ObjectDetection found;
  found.num_points = static_cast<int>(group.size());
  found.height_m = height_m;
  found.left_m = groundAt(high_rad);
  found.right_m = groundAt(low_rad);
  found.position_m = groundAt(0.5 * (low_rad + high_rad));
  for (PlacedPoint& placed : group) {
    placed.contact = *contact;
  }
  Eigen::Matrix2d velocity_covariance;
  if (!fitVelocity(group, camera_m, &found, &velocity_covariance)) {
    return std::nullopt;
  }
  const Eigen::Vector2d along = (found.position_m - camera_m.head<2>()).normalized();
  found.away = along;
  const double across_m = 0.03 + 0.01 * range_m + 0.1 * (found.left_m - found.right_m).norm();
  // A wrong range moves the contact along the view, and scales the motion that is seen from the moving
  // camera.
  const MovingPoint& first = *group.front().point;
  const Eigen::Vector2d camera_velocity =
      (camera_m - first.before_from_now.inverse() * camera_m).head<2>() / first.age_s;
  Eigen::Vector4d by_range;
  by_range << along, (found.velocity_m_per_s - camera_velocity) / range_m;
  found.covariance = sigma_m * sigma_m * by_range * by_range.transpose();
  found.covariance.topLeftCorner<2, 2>() +=
      across_m * across_m * (Eigen::Matrix2d::Identity() - along * along.transpose());
  found.covariance.bottomRightCorner<2, 2>() +=
      velocity_covariance +
      kAcross_m_per_s * kAcross_m_per_s * (Eigen::Matrix2d::Identity() - along * along.transpose()) +
      kAlong_m_per_s * kAlong_m_per_s * along * along.transpose();
  return found;
}

}  // namespace

std::vector<ObjectDetection> detectObjects(const std::vector<MovingPoint>& points,
                                           const GroundContact& contact,
                                           const Eigen::Vector3d& camera_in_vehicle_m) {
  std::vector<PlacedPoint> placed;
  for (const MovingPoint& point : points) {
    if (const std::optional<Contact> found = contact.below(point.ray_in_vehicle)) {
      const Eigen::Vector3d& ray = point.ray_in_vehicle;
      if (camera_in_vehicle_m.z() + found->range_m * slopeOf(ray) < kMinPointHeight_m) {
        continue;
      }
      const double azimuth_rad = std::atan2(ray.y(), ray.x());
      const Eigen::Vector3d before = point.before_from_now.rotation().conjugate() * point.ray_before;
      const double turned_rad = std::remainder(azimuth_rad - std::atan2(before.y(), before.x()), 2.0 * M_PI);
      placed.push_back({&point, azimuth_rad, turned_rad / point.age_s, *found});
    }
  }
  std::vector<ObjectDetection> objects;
  for (std::vector<PlacedPoint>& group : groupOf(placed)) {
    if (const std::optional<ObjectDetection> found =
            fitObject(std::move(group), contact, camera_in_vehicle_m)) {
      objects.push_back(*found);
    }
  }
  return objects;
}

}  // namespace vcharge
