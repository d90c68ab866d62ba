#pragma once

#include <array>
#include <cmath>

#include "vcharge_geometry/solvers/point_match.h"

namespace vcharge {

/// The three equations of every three-point pose: with p_i = o_i + lambda_i d_i in the rig frame,
/// |p_i - p_j|^2 = |X_i - X_j|^2 for the pairs (1,2), (1,3), (2,3).
/// As a quadratic in both depths:
/// lambda_i^2 + lambda_j^2 + mixed lambda_i lambda_j + first lambda_i + second lambda_j + constant = 0.
/// Lengths are in units of the longest side.
struct PairDistance {
  double mixed;
  double first;
  double second;
  double constant;

  PairDistance() = default;
  PairDistance(const Ray& a, const Ray& b, double inverse_unit, double squared_distance) {
    const Eigen::Vector3d origins = inverse_unit * (a.origin_m - b.origin_m);
    mixed = -2.0 * a.direction.dot(b.direction);
    first = 2.0 * a.direction.dot(origins);
    second = -2.0 * b.direction.dot(origins);
    constant = origins.squaredNorm() - squared_distance;
  }
  double value(double a, double b) const {
    return a * a + b * b + mixed * a * b + first * a + second * b + constant;
  }
  double byFirst(double a, double b) const { return 2.0 * a + mixed * b + first; }
  double bySecond(double a, double b) const { return 2.0 * b + mixed * a + second; }
};

/// Pairs (1,2), (1,3), (2,3).
using TriangleDistances = std::array<PairDistance, 3>;

/// Refines depths by Newton's method on the three equations. Returns false unless the result satisfies them.
/// Depths may have any sign.
inline bool polishDepths(const TriangleDistances& pairs, Eigen::Vector3d* depths) {
  Eigen::Vector3d& d = *depths;
  for (int iteration = 0; iteration < 5; ++iteration) {
    const double e12 = pairs[0].value(d[0], d[1]);
    const double e13 = pairs[1].value(d[0], d[2]);
    const double e23 = pairs[2].value(d[1], d[2]);
    const double size = 1.0 + d.squaredNorm();
    const double error = std::abs(e12) + std::abs(e13) + std::abs(e23);
    if (error <= 4e-15 * size) {
      break;
    }
    if (!(error <= 0.1 * size)) {
      return false;
    }
    const double a = pairs[0].byFirst(d[0], d[1]);
    const double b = pairs[0].bySecond(d[0], d[1]);
    const double c = pairs[1].byFirst(d[0], d[2]);
    const double e = pairs[1].bySecond(d[0], d[2]);
    const double f = pairs[2].byFirst(d[1], d[2]);
    const double g = pairs[2].bySecond(d[1], d[2]);
    // The rows are (a b 0), (c 0 e), (0 f g).
    const double determinant = -a * e * f - b * c * g;
    if (determinant == 0.0) {
      break;
    }
    const double inverse = 1.0 / determinant;
    d[0] -= inverse * (-e * f * e12 - b * g * e13 + b * e * e23);
    d[1] -= inverse * (-c * g * e12 + a * g * e13 - a * e * e23);
    d[2] -= inverse * (c * f * e12 - a * f * e13 - b * c * e23);
  }
  const double error = std::abs(pairs[0].value(d[0], d[1])) + std::abs(pairs[1].value(d[0], d[2])) +
                       std::abs(pairs[2].value(d[1], d[2]));
  return error <= 1e-9 * (1.0 + d.squaredNorm());
}

/// Adds the pose for the depths (metres) along the three rays if all points lie in front of their cameras.
template <int Capacity>
void addPoseOfDepths(const std::array<PointMatch, 3>& matches, const Eigen::Matrix3d& map_axes,
                     const Eigen::Vector3d& depths_m, FixedVector<RotationTranslation, Capacity>* poses) {
  if (!(depths_m.minCoeff() > 0.0)) {
    return;
  }
  std::array<Eigen::Vector3d, 3> points;
  for (size_t i = 0; i < 3; ++i) {
    points[i] = matches[i].ray.origin_m + depths_m[static_cast<Eigen::Index>(i)] * matches[i].ray.direction;
  }
  Eigen::Matrix3d rig_axes;
  if (!triangleAxes(points[0], points[1], points[2], &rig_axes)) {
    return;
  }
  RotationTranslation pose;
  pose.rotation = map_axes * rig_axes.transpose();
  pose.translation_m = matches[0].point_m - pose.rotation * points[0];
  poses->push_back(pose);
}

}  // namespace vcharge
