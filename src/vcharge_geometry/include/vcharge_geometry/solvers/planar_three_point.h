#pragma once

#include <array>

#include "vcharge_geometry/solvers/solver_status.h"
#include "vcharge_geometry/solvers/yaw_epipolar_constraint.h"

namespace vcharge {

/// Planar motion from three line matches: Lee, Fraundorfer, Pollefeys, "Structureless pose-graph loop-closure
/// with a multi-camera system on a self-driving car", IROS 2013.
/// The rig rotates by theta about z and translates by (x, y, 0). With the translation in the half-rotated
/// basis, the constraint of each match is rotation + along * u + across * w = 0 (yaw_epipolar_constraint.h,
/// degrees 2, 1, 1 in cos(theta/2), sin(theta/2)); the determinant of three of them is a form of degree 4: at
/// most 4 motions, with any yaw including pi.
/// If all matches stay within one camera, zero motion is always a solution and is left out. Without rotation,
/// the length of the translation is then undetermined (scale_observable).
inline SolverStatus solvePlanarThreePoint(const std::array<LineMatch, 3>& matches,
                                          FixedVector<YawMotion, 4>* motions) {
  motions->clear();
  const std::array<YawEpipolarConstraint, 3> constraints{YawEpipolarConstraint(matches[0]),
                                                         YawEpipolarConstraint(matches[1]),
                                                         YawEpipolarConstraint(matches[2])};
  const auto minor = [&constraints](size_t i, size_t j) {
    return determinant(constraints[i].along, constraints[i].across, constraints[j].along,
                       constraints[j].across);
  };
  const std::array<Polynomial<2>, 3> minors{minor(1, 2), minor(2, 0), minor(0, 1)};
  Polynomial<4> quartic{};
  double size = 0.0;
  bool trivial = true;
  for (size_t i = 0; i < 3; ++i) {
    addScaled(multiply(constraints[i].rotation, minors[i]), 1.0, &quartic);
    size += largestMagnitude(constraints[i].rotation);
    trivial = trivial && constraints[i].holdsWithoutMotion();
  }
  if (!allFinite(quartic)) {
    return SolverStatus::kNotFinite;
  }
  if (largestMagnitude(quartic) <= 1e-14 * size) {
    return SolverStatus::kDegenerate;
  }
  const auto addMotion = [&](const HalfAngle& half) {
    // The translation follows from the two best conditioned of the three equations.
    size_t best = 0;
    double best_minor = 0.0;
    for (size_t i = 0; i < 3; ++i) {
      const double value = valueAt(minors[i], half);
      if (std::abs(value) > std::abs(best_minor)) {
        best = i;
        best_minor = value;
      }
    }
    const YawEpipolarConstraint& a = constraints[(best + 1) % 3];
    const YawEpipolarConstraint& b = constraints[(best + 2) % 3];
    const double a_along = valueAt(a.along, half);
    const double a_across = valueAt(a.across, half);
    const double b_along = valueAt(b.along, half);
    const double b_across = valueAt(b.across, half);
    YawMotion motion;
    motion.half_yaw = half;
    if (std::abs(best_minor) > 1e-9) {
      const double a_rotation = valueAt(a.rotation, half);
      const double b_rotation = valueAt(b.rotation, half);
      motion.along = (a_across * b_rotation - b_across * a_rotation) / best_minor;
      motion.across = (b_along * a_rotation - a_along * b_rotation) / best_minor;
    } else {
      // The rows are parallel: the translation is perpendicular to the longest and has an undetermined
      // length.
      double along = 0.0;
      double across = 0.0;
      for (const YawEpipolarConstraint& constraint : constraints) {
        const double row_along = valueAt(constraint.along, half);
        const double row_across = valueAt(constraint.across, half);
        if (std::hypot(row_along, row_across) > std::hypot(along, across)) {
          along = row_along;
          across = row_across;
        }
      }
      const double length = std::hypot(along, across);
      if (length <= 1e-9) {
        return;
      }
      motion.scale_observable = false;
      motion.along = across / length;
      motion.across = -along / length;
      const double sign = directionSign(matches.data(), 3, motion.transform());
      motion.along *= sign;
      motion.across *= sign;
    }
    motions->push_back(motion);
  };
  if (trivial) {
    for (const HalfAngle& half :
         halfAngleRoots(Polynomial<3>{quartic[1], quartic[2], quartic[3], quartic[4]})) {
      addMotion(half);
    }
  } else {
    for (const HalfAngle& half : halfAngleRoots(quartic)) {
      addMotion(half);
    }
  }
  return SolverStatus::kOk;
}

}  // namespace vcharge
