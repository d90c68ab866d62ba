#pragma once

#include <array>

#include "vcharge_geometry/solvers/solver_status.h"
#include "vcharge_geometry/solvers/yaw_epipolar_constraint.h"

namespace vcharge {

/// Motion with known vertical from four line matches: Lee, Pollefeys, Fraundorfer, "Relative pose estimation
/// for a multi-camera system with known vertical direction", CVPR 2014.
/// Both lines of each match are given in frames whose z axis is vertical (the rig frames, rotated by their
/// roll and pitch), so the motion is a rotation by theta about z and any translation. The constraint of each
/// match is rotation + along * u + across * w + up * z = 0 (yaw_epipolar_constraint.h, degrees 2, 1, 1, 2);
/// the determinant of four of them is a form of degree 6 in cos(theta/2), sin(theta/2): at most 6 motions.
/// If all matches stay within one camera, and roll and pitch did not change, zero motion is always a solution
/// and is left out. Without rotation, the length of the translation is then undetermined (scale_observable).
inline SolverStatus solveKnownVerticalFourPoint(const std::array<LineMatch, 4>& matches,
                                                FixedVector<YawMotion, 6>* motions) {
  motions->clear();
  const std::array<YawEpipolarConstraint, 4> constraints{
      YawEpipolarConstraint(matches[0]), YawEpipolarConstraint(matches[1]), YawEpipolarConstraint(matches[2]),
      YawEpipolarConstraint(matches[3])};
  const auto horizontalMinor = [&constraints](size_t i, size_t j) {
    return determinant(constraints[i].along, constraints[i].across, constraints[j].along,
                       constraints[j].across);
  };
  const auto otherMinor = [&constraints](size_t i, size_t j) {
    return determinant(constraints[i].rotation, constraints[i].up, constraints[j].rotation,
                       constraints[j].up);
  };
  // Laplace expansion along the columns (along, across) and (rotation, up).
  Polynomial<6> sextic{};
  addScaled(multiply(horizontalMinor(0, 1), otherMinor(2, 3)), 1.0, &sextic);
  addScaled(multiply(horizontalMinor(0, 2), otherMinor(1, 3)), -1.0, &sextic);
  addScaled(multiply(horizontalMinor(0, 3), otherMinor(1, 2)), 1.0, &sextic);
  addScaled(multiply(horizontalMinor(1, 2), otherMinor(0, 3)), 1.0, &sextic);
  addScaled(multiply(horizontalMinor(1, 3), otherMinor(0, 2)), -1.0, &sextic);
  addScaled(multiply(horizontalMinor(2, 3), otherMinor(0, 1)), 1.0, &sextic);
  double size = 0.0;
  bool trivial = true;
  for (const YawEpipolarConstraint& constraint : constraints) {
    size += largestMagnitude(constraint.rotation);
    trivial = trivial && constraint.holdsWithoutMotion();
  }
  if (!allFinite(sextic)) {
    return SolverStatus::kNotFinite;
  }
  if (largestMagnitude(sextic) <= 1e-15 * size) {
    return SolverStatus::kDegenerate;
  }
  const auto addMotion = [&](const HalfAngle& half) {
    std::array<Eigen::Vector3d, 4> rows;
    Eigen::Vector4d rotation;
    for (size_t i = 0; i < 4; ++i) {
      rows[i] = Eigen::Vector3d(valueAt(constraints[i].along, half), valueAt(constraints[i].across, half),
                                valueAt(constraints[i].up, half));
      rotation[static_cast<Eigen::Index>(i)] = valueAt(constraints[i].rotation, half);
    }
    // The translation follows from the three best conditioned of the four equations.
    std::array<size_t, 3> best{0, 1, 2};
    double best_determinant = 0.0;
    constexpr std::array<std::array<size_t, 3>, 4> kTriples{{{0, 1, 2}, {0, 1, 3}, {0, 2, 3}, {1, 2, 3}}};
    for (const std::array<size_t, 3>& triple : kTriples) {
      const double value = rows[triple[0]].dot(rows[triple[1]].cross(rows[triple[2]]));
      if (std::abs(value) > std::abs(best_determinant)) {
        best = triple;
        best_determinant = value;
      }
    }
    const Eigen::Vector3d& a = rows[best[0]];
    const Eigen::Vector3d& b = rows[best[1]];
    const Eigen::Vector3d& c = rows[best[2]];
    YawMotion motion;
    motion.half_yaw = half;
    Eigen::Vector3d translation;
    if (std::abs(best_determinant) > 1e-10) {
      translation = -(rotation[static_cast<Eigen::Index>(best[0])] * b.cross(c) +
                      rotation[static_cast<Eigen::Index>(best[1])] * c.cross(a) +
                      rotation[static_cast<Eigen::Index>(best[2])] * a.cross(b)) /
                    best_determinant;
    } else {
      // The rows span a plane: the translation has the direction of its normal and an undetermined length.
      translation.setZero();
      for (size_t i = 0; i < 4; ++i) {
        for (size_t j = i + 1; j < 4; ++j) {
          const Eigen::Vector3d normal = rows[i].cross(rows[j]);
          if (normal.squaredNorm() > translation.squaredNorm()) {
            translation = normal;
          }
        }
      }
      if (translation.squaredNorm() <= 1e-16) {
        return;
      }
      translation.normalize();
      motion.scale_observable = false;
    }
    motion.along = translation.x();
    motion.across = translation.y();
    motion.up = translation.z();
    if (!motion.scale_observable) {
      const double sign = directionSign(matches.data(), 4, motion.transform());
      motion.along *= sign;
      motion.across *= sign;
      motion.up *= sign;
    }
    motions->push_back(motion);
  };
  if (trivial) {
    const Polynomial<5> quintic{sextic[1], sextic[2], sextic[3], sextic[4], sextic[5], sextic[6]};
    for (const HalfAngle& half : halfAngleRoots(quintic)) {
      addMotion(half);
    }
  } else {
    for (const HalfAngle& half : halfAngleRoots(sextic)) {
      addMotion(half);
    }
  }
  return SolverStatus::kOk;
}

}  // namespace vcharge
