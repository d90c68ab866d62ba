#pragma once

#include <algorithm>
#include <array>

#include "vcharge_geometry/solvers/fixed_vector.h"
#include "vcharge_geometry/solvers/polynomial.h"
#include "vcharge_geometry/solvers/solver_status.h"
#include "vcharge_geometry/solvers/triangle_depths.h"

namespace vcharge {

/// Pose from three points seen from one centre (P3P); the equations are Grunert's, reviewed by Haralick et
/// al., "Review and analysis of solutions of the three point perspective pose estimation problem", IJCV 1994.
///
/// With lambda_2 = u lambda_1, lambda_3 = v lambda_1, x = 1 / lambda_1^2 and D_ij the squared sides,
///   u^2 + b_2 u + (1 - D_12 x) = 0,  v^2 + b_3 v + (1 - D_13 x) = 0,  u^2 + v^2 + alpha u v - D_23 x = 0.
/// The first two replace the squares in the third, which gives v as a fraction in u; put back into the second
/// it leaves U u + V = 0 with U, V of degrees 1 and 2 in x, and the first then a quartic in x: at most 4
/// poses with all points in front. All rays are assumed to start at the origin of the first ray.
inline SolverStatus solvePerspectiveThreePoint(const std::array<PointMatch, 3>& matches,
                                               FixedVector<RotationTranslation, 4>* poses) {
  poses->clear();
  Eigen::Matrix3d map_axes;
  const std::array<double, 3> squared{(matches[0].point_m - matches[1].point_m).squaredNorm(),
                                      (matches[0].point_m - matches[2].point_m).squaredNorm(),
                                      (matches[1].point_m - matches[2].point_m).squaredNorm()};
  const double unit_squared = std::max({squared[0], squared[1], squared[2]});
  if (!std::isfinite(squared[0] + squared[1] + squared[2] + matches[0].ray.origin_m.sum())) {
    return SolverStatus::kNotFinite;
  }
  if (!triangleAxes(matches[0].point_m, matches[1].point_m, matches[2].point_m, &map_axes)) {
    return SolverStatus::kDegenerate;
  }
  const double unit = std::sqrt(unit_squared);
  std::array<PointMatch, 3> central = matches;
  central[1].ray.origin_m = central[2].ray.origin_m = matches[0].ray.origin_m;
  const TriangleDistances pairs{
      PairDistance(central[0].ray, central[1].ray, 1.0 / unit, squared[0] / unit_squared),
      PairDistance(central[0].ray, central[2].ray, 1.0 / unit, squared[1] / unit_squared),
      PairDistance(central[1].ray, central[2].ray, 1.0 / unit, squared[2] / unit_squared)};
  const double b2 = pairs[0].mixed;
  const double b3 = pairs[1].mixed;
  const double alpha = pairs[2].mixed;
  const Polynomial<1> c2{1.0, pairs[0].constant};
  const Polynomial<1> c3{1.0, pairs[1].constant};
  // alpha u v - b2 u - b3 v + delta = 0
  const Polynomial<1> delta{-2.0, pairs[2].constant - pairs[0].constant - pairs[1].constant};
  // (delta - b2 u)^2 - b3 (delta - b2 u)(alpha u - b3) + c3 (alpha u - b3)^2 = p u^2 + q u + s
  const Polynomial<1> p{b2 * b2 + b3 * alpha * b2 + alpha * alpha * c3[0], alpha * alpha * c3[1]};
  Polynomial<1> q{-b3 * b3 * b2 - 2.0 * alpha * b3 * c3[0], -2.0 * alpha * b3 * c3[1]};
  addScaled(delta, -2.0 * b2 - b3 * alpha, &q);
  Polynomial<2> s = multiply(delta, delta);
  addScaled(delta, b3 * b3, &s);
  addScaled(c3, b3 * b3, &s);
  // With u^2 = -b2 u - c2: slope u + offset = 0
  Polynomial<1> slope = q;
  addScaled(p, -b2, &slope);
  Polynomial<2> offset = s;
  addScaled(multiply(p, c2), -1.0, &offset);
  Polynomial<4> quartic = multiply(offset, offset);
  addScaled(multiply(slope, offset), -b2, &quartic);
  addScaled(multiply(c2, multiply(slope, slope)), 1.0, &quartic);
  if (!allFinite(quartic)) {
    return SolverStatus::kNotFinite;
  }
  const double slope_size = 1e-6 * (largestMagnitude(q) + std::abs(b2) * largestMagnitude(p));
  for (const double x : positiveRealRoots(quartic)) {
    const double depth = 1.0 / std::sqrt(x);
    const auto addByRatio = [&](double u) {
      const double v = -(evaluate(delta, x) - b2 * u) / (alpha * u - b3);
      Eigen::Vector3d depths(depth, u * depth, v * depth);
      const bool converged = polishDepths(pairs, &depths);
      if (converged) {
        addPoseOfDepths(central, map_axes, unit * depths, poses);
      }
      return converged;
    };
    const double slope_value = evaluate(slope, x);
    if (std::abs(slope_value) <= slope_size * (1.0 + x) || !addByRatio(-evaluate(offset, x) / slope_value)) {
      // Two poses have the same depth, as for symmetric triangles.
      for (const double u : quadraticRoots(1.0, b2, evaluate(c2, x))) {
        addByRatio(u);
      }
    }
  }
  return SolverStatus::kOk;
}

}  // namespace vcharge
