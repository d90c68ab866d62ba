#pragma once

#include <array>

#include "vcharge_geometry/solvers/solver_status.h"
#include "vcharge_geometry/solvers/yaw_epipolar_constraint.h"

namespace vcharge {

/// Motion of a car without slip from two line matches: Lee, Fraundorfer, Pollefeys, "Motion estimation for
/// self-driving cars with a generalized camera", CVPR 2013.
/// The origin of the vehicle frame is the centre of the non-steered axle, x forward, z up. The car moves on a
/// circle: previous_from_current rotates by theta about z and translates by rho in the direction (c, s, 0), c
/// = cos(theta/2), s = sin(theta/2). The constraint of each match is rotation(c, s) + rho * along(c, s) = 0
/// (yaw_epipolar_constraint.h, degrees 2 and 1). Two matches give the homogeneous cubic rotation_1 along_2 -
/// rotation_2 along_1 = 0: at most 3 motions. `along` > 0 is forward motion; `across` and `up` are 0.
/// If both matches stay within one camera, zero motion is always a solution and is left out. Straight motion
/// then leaves rho undetermined (scale_observable is false, along = +-1 by the sign of the depths); take it
/// from odometry.
inline SolverStatus solveAckermannTwoPoint(const std::array<LineMatch, 2>& matches,
                                           FixedVector<YawMotion, 3>* motions) {
  motions->clear();
  const YawEpipolarConstraint first(matches[0]);
  const YawEpipolarConstraint second(matches[1]);
  const Polynomial<3> cubic = determinant(first.rotation, first.along, second.rotation, second.along);
  if (!allFinite(cubic)) {
    return SolverStatus::kNotFinite;
  }
  const double rotation_size = largestMagnitude(first.rotation) + largestMagnitude(second.rotation);
  if (largestMagnitude(cubic) <= 1e-14 * rotation_size) {
    return SolverStatus::kDegenerate;
  }
  const auto addMotion = [&](const HalfAngle& half) {
    const double first_along = valueAt(first.along, half);
    const double second_along = valueAt(second.along, half);
    const double squared = first_along * first_along + second_along * second_along;
    YawMotion motion;
    motion.half_yaw = half;
    if (squared > 1e-18) {
      motion.along =
          -(first_along * valueAt(first.rotation, half) + second_along * valueAt(second.rotation, half)) /
          squared;
    } else {
      motion.scale_observable = false;
      motion.along = 1.0;
      motion.along = directionSign(matches.data(), 2, motion.transform());
    }
    motions->push_back(motion);
  };
  if (first.holdsWithoutMotion() && second.holdsWithoutMotion()) {
    for (const HalfAngle& half : halfAngleRoots(Polynomial<2>{cubic[1], cubic[2], cubic[3]})) {
      addMotion(half);
    }
  } else {
    for (const HalfAngle& half : halfAngleRoots(cubic)) {
      addMotion(half);
    }
  }
  return SolverStatus::kOk;
}

}  // namespace vcharge
