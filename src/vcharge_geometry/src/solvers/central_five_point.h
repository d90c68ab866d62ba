#pragma once

#include <array>

#include "vcharge_core/motion/rigid_transform.h"
#include "vcharge_geometry/solvers/fixed_vector.h"
#include "vcharge_geometry/solvers/pluecker_line.h"

namespace vcharge {

/// Motion of one camera; the translation is a unit vector.
struct CentralMotion {
  RigidTransform previous_from_current;
  const RigidTransform& transform() const { return previous_from_current; }
};
/// At most ten essential matrices with four motions each.
using CentralMotions = FixedVector<CentralMotion, 40>;

/// All motions of a camera at the origin from five matches (Nister, "An efficient solution to the five-point
/// relative pose problem", PAMI 2004). The caller chooses, among the four motions of each essential matrix,
/// the one with points in front of the camera.
void solveCentralFivePoint(const std::array<LineMatch, 5>& matches, CentralMotions* motions);

}  // namespace vcharge
