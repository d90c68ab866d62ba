#pragma once

#include <algorithm>
#include <array>

#include "vcharge_geometry/solvers/fixed_vector.h"
#include "vcharge_geometry/solvers/perspective_three_point.h"
#include "vcharge_geometry/solvers/polynomial.h"
#include "vcharge_geometry/solvers/solver_status.h"
#include "vcharge_geometry/solvers/triangle_depths.h"

namespace vcharge {

/// Pose of a generalized camera from three points: Lee, Li, Fraundorfer, Pollefeys, "Minimal solutions for
/// pose estimation of a multi-camera system", ISRR 2013 (IJRR 2015: "Minimal solutions for the multi-camera
/// pose estimation problem").
///
/// The distances between the points p_i = o_i + lambda_i d_i are those in the map (triangle_depths.h). The
/// pairs (1,2) and (1,3) are monic quadratics in lambda_2 and lambda_3, lambda_2^2 + b_2 lambda_2 + c_2 = 0
/// (b, c of degrees 1, 2 in lambda_1). Put into the pair (2,3) they leave
///   alpha lambda_2 lambda_3 + beta lambda_2 + gamma lambda_3 + delta = 0,
/// hence lambda_3 as a fraction in lambda_2; put into the pair (1,3) and reduced by the pair (1,2) this
/// becomes U lambda_2 + V = 0 (degrees 3, 4), and the pair (1,2) becomes V^2 - b_2 U V + c_2 U^2 = 0, of
/// degree 8: at most 8 poses with all points in front of their cameras. The elimination does not degenerate
/// when the rays share a centre; then the octic is a quartic in lambda_1^2, and plain P3P is faster and is
/// called instead.
inline SolverStatus solveGeneralizedThreePoint(const std::array<PointMatch, 3>& matches,
                                               FixedVector<RotationTranslation, 8>* poses) {
  poses->clear();
  const std::array<double, 3> squared{(matches[0].point_m - matches[1].point_m).squaredNorm(),
                                      (matches[0].point_m - matches[2].point_m).squaredNorm(),
                                      (matches[1].point_m - matches[2].point_m).squaredNorm()};
  const double unit_squared = std::max({squared[0], squared[1], squared[2]});
  const double spread_squared = (matches[0].ray.origin_m - matches[1].ray.origin_m).squaredNorm() +
                                (matches[0].ray.origin_m - matches[2].ray.origin_m).squaredNorm();
  if (!std::isfinite(squared[0] + squared[1] + squared[2] + spread_squared)) {
    return SolverStatus::kNotFinite;
  }
  if (spread_squared <= 1e-28 * unit_squared) {
    FixedVector<RotationTranslation, 4> central_poses;
    const SolverStatus status = solvePerspectiveThreePoint(matches, &central_poses);
    for (const RotationTranslation& pose : central_poses) {
      poses->push_back(pose);
    }
    return status;
  }
  Eigen::Matrix3d map_axes;
  if (!triangleAxes(matches[0].point_m, matches[1].point_m, matches[2].point_m, &map_axes)) {
    return SolverStatus::kDegenerate;
  }
  const double unit = std::sqrt(unit_squared);
  const TriangleDistances pairs{
      PairDistance(matches[0].ray, matches[1].ray, 1.0 / unit, squared[0] / unit_squared),
      PairDistance(matches[0].ray, matches[2].ray, 1.0 / unit, squared[1] / unit_squared),
      PairDistance(matches[1].ray, matches[2].ray, 1.0 / unit, squared[2] / unit_squared)};
  // Coefficients are polynomials in lambda_1.
  const Polynomial<1> b2{pairs[0].second, pairs[0].mixed};
  const Polynomial<2> c2{pairs[0].constant, pairs[0].first, 1.0};
  const Polynomial<1> b3{pairs[1].second, pairs[1].mixed};
  const Polynomial<2> c3{pairs[1].constant, pairs[1].first, 1.0};
  const double alpha = pairs[2].mixed;
  const Polynomial<1> beta{pairs[2].first - b2[0], -b2[1]};
  const Polynomial<1> gamma{pairs[2].second - b3[0], -b3[1]};
  const Polynomial<2> delta{pairs[2].constant - c2[0] - c3[0], -c2[1] - c3[1], -2.0};
  // (beta l2 + delta)^2 - b3 (beta l2 + delta)(alpha l2 + gamma) + c3 (alpha l2 + gamma)^2 = p l2^2 + q l2 +
  // s
  Polynomial<2> p = multiply(beta, beta);
  addScaled(multiply(b3, beta), -alpha, &p);
  addScaled(c3, alpha * alpha, &p);
  Polynomial<2> beta_gamma_plus = multiply(beta, gamma);
  addScaled(delta, alpha, &beta_gamma_plus);
  Polynomial<3> q = multiply(beta, delta);
  for (double& coefficient : q) {
    coefficient *= 2.0;
  }
  addScaled(multiply(b3, beta_gamma_plus), -1.0, &q);
  addScaled(multiply(c3, gamma), 2.0 * alpha, &q);
  Polynomial<4> s = multiply(delta, delta);
  addScaled(multiply(b3, multiply(delta, gamma)), -1.0, &s);
  addScaled(multiply(c3, multiply(gamma, gamma)), 1.0, &s);
  Polynomial<3> slope = q;
  addScaled(multiply(p, b2), -1.0, &slope);
  Polynomial<4> offset = s;
  addScaled(multiply(p, c2), -1.0, &offset);
  Polynomial<8> octic = multiply(offset, offset);
  addScaled(multiply(b2, multiply(slope, offset)), -1.0, &octic);
  addScaled(multiply(c2, multiply(slope, slope)), 1.0, &octic);
  if (!allFinite(octic)) {
    return SolverStatus::kNotFinite;
  }
  const double slope_size = 1e-6 * (largestMagnitude(q) + largestMagnitude(p) * largestMagnitude(b2));
  for (const double depth : positiveRealRoots(octic)) {
    const double beta_value = evaluate(beta, depth);
    const double gamma_value = evaluate(gamma, depth);
    const double delta_value = evaluate(delta, depth);
    const auto addByDepth = [&](double second_depth) {
      const double third_depth =
          -(beta_value * second_depth + delta_value) / (alpha * second_depth + gamma_value);
      Eigen::Vector3d depths(depth, second_depth, third_depth);
      const bool converged = polishDepths(pairs, &depths);
      if (converged) {
        addPoseOfDepths(matches, map_axes, unit * depths, poses);
      }
      return converged;
    };
    const double slope_value = evaluate(slope, depth);
    if (std::abs(slope_value) <= slope_size * (1.0 + depth * depth * depth) ||
        !addByDepth(-evaluate(offset, depth) / slope_value)) {
      // Two poses have the same depth, as for symmetric triangles or parallel rays.
      for (const double second_depth : quadraticRoots(1.0, evaluate(b2, depth), evaluate(c2, depth))) {
        addByDepth(second_depth);
      }
    }
  }
  return SolverStatus::kOk;
}

}  // namespace vcharge
