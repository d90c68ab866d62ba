#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <vector>

#include <Eigen/Core>

#include "vcharge_core/motion/rigid_transform.h"
#include "vcharge_geometry/solvers/pluecker_line.h"
#include "vcharge_geometry/solvers/point_match.h"

namespace vcharge {

/// Random problems with known solution, for tests and benchmarks: four cameras of a car, points 2 to 20 m
/// away in all directions.
class RandomProblems {
 public:
  explicit RandomProblems(unsigned seed) : generator_(seed) {}

  double uniform(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(generator_);
  }
  double normal(double sigma) { return std::normal_distribution<double>(0.0, sigma)(generator_); }
  int integer(int limit) { return std::uniform_int_distribution<int>(0, limit - 1)(generator_); }

  static Eigen::Vector3d cameraCentre(int camera) {
    const std::array<Eigen::Vector3d, 4> centres{
        Eigen::Vector3d(3.6, 0.0, 0.6), Eigen::Vector3d(2.0, 0.95, 0.9), Eigen::Vector3d(-0.8, 0.05, 0.85),
        Eigen::Vector3d(2.0, -0.95, 0.9)};
    return centres[static_cast<size_t>(camera)];
  }

  Eigen::Vector3d direction() { return Eigen::Vector3d(normal(1.0), normal(1.0), normal(1.0)).normalized(); }
  Eigen::Vector3d point() { return uniform(2.0, 20.0) * direction(); }

  Eigen::Quaterniond rotation(double largest_angle_rad) {
    return rotationFromVector(uniform(0.0, largest_angle_rad) * direction());
  }

  /// previous_from_current on a circle around a point on the rear axle, from yaw and chord length.
  static RigidTransform ackermannMotion(double yaw_rad, double distance_m) {
    return RigidTransform::planar(distance_m * std::cos(0.5 * yaw_rad), distance_m * std::sin(0.5 * yaw_rad),
                                  yaw_rad);
  }

  static Ray rayTo(const Eigen::Vector3d& point, int camera) {
    return {cameraCentre(camera), (point - cameraCentre(camera)).normalized()};
  }

  /// Rotates a ray by normally distributed angles about two axes, sigma_rad each.
  Ray disturbed(const Ray& ray, double sigma_rad) {
    const Eigen::Vector3d side = ray.direction.unitOrthogonal();
    const Eigen::Vector3d other = ray.direction.cross(side);
    const double first = normal(sigma_rad);
    const double second = normal(sigma_rad);
    return {ray.origin_m, (ray.direction + first * side + second * other).normalized()};
  }

  LineMatch lineMatch(const RigidTransform& previous_from_current, int previous_camera, int current_camera,
                      double sigma_rad = 0.0) {
    const Eigen::Vector3d in_previous = point();
    const Eigen::Vector3d in_current = previous_from_current.inverse() * in_previous;
    Ray previous = rayTo(in_previous, previous_camera);
    Ray current = rayTo(in_current, current_camera);
    if (sigma_rad > 0.0) {
      previous = disturbed(previous, sigma_rad);
      current = disturbed(current, sigma_rad);
    }
    return {lineOfRay(previous), lineOfRay(current)};
  }

  /// Matches of random cameras, with the given probability within one camera; never all of the same pair of
  /// cameras, which would be a central camera without scale.
  template <size_t N>
  std::array<LineMatch, N> lineMatches(const RigidTransform& previous_from_current, double same_camera,
                                       double sigma_rad = 0.0) {
    std::array<LineMatch, N> matches;
    const int first_camera = integer(4);
    for (size_t i = 0; i < N; ++i) {
      const int previous_camera =
          i == 0 ? first_camera : (i == 1 ? (first_camera + 1 + integer(3)) % 4 : integer(4));
      const int current_camera = uniform(0.0, 1.0) < same_camera ? previous_camera : integer(4);
      matches[i] = lineMatch(previous_from_current, previous_camera, current_camera, sigma_rad);
    }
    return matches;
  }

  /// Points observed by random cameras of a rig at map_from_rig. `scale` multiplies the spread of the centres
  /// (0: a single centre).
  template <size_t N>
  std::array<PointMatch, N> pointMatches(const RigidTransform& map_from_rig, double scale = 1.0,
                                         double sigma_rad = 0.0) {
    std::array<PointMatch, N> matches;
    for (PointMatch& match : matches) {
      const Eigen::Vector3d in_rig = point();
      const Eigen::Vector3d centre = cameraCentre(0) + scale * (cameraCentre(integer(4)) - cameraCentre(0));
      match.ray = {centre, (in_rig - centre).normalized()};
      if (sigma_rad > 0.0) {
        match.ray = disturbed(match.ray, sigma_rad);
      }
      match.point_m = map_from_rig * in_rig;
    }
    return matches;
  }

  RigidTransform pose() {
    return RigidTransform(rotation(M_PI), 10.0 * Eigen::Vector3d(normal(1.0), normal(1.0), normal(1.0)));
  }
  RigidTransform uprightPose() {
    return RigidTransform(rotationFromYawPitchRoll(uniform(-M_PI, M_PI), 0.0, 0.0),
                          10.0 * Eigen::Vector3d(normal(1.0), normal(1.0), normal(1.0)));
  }

 private:
  std::mt19937 generator_;
};

/// Difference of two transforms in radians plus metres.
inline double transformError(const RigidTransform& a, const RigidTransform& b) {
  return angleOfRotation(a.rotation().conjugate() * b.rotation()) +
         (a.translation() - b.translation()).norm();
}

/// Smallest transformError() of all solutions; infinite if there is none.
template <class Solutions>
double smallestError(const Solutions& solutions, const RigidTransform& truth) {
  double smallest = INFINITY;
  for (const auto& solution : solutions) {
    smallest = std::min(smallest, transformError(solution.transform(), truth));
  }
  return smallest;
}

/// The value below which the given fraction of values lies.
inline double quantile(std::vector<double> values, double fraction) {
  std::sort(values.begin(), values.end());
  return values[static_cast<size_t>(fraction * static_cast<double>(values.size() - 1))];
}

}  // namespace vcharge
