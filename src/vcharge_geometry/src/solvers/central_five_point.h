#pragma once

#include <array>

#include "vcharge_core/motion/rigid_transform.h"
#include "vcharge_geometry/solvers/fixed_vector.h"
#include "vcharge_geometry/solvers/pluecker_line.h"

namespace vcharge {

/// A motion of one camera; the translation is a unit vector.
struct CentralMotion {
  RigidTransform previous_from_current;
  const RigidTransform& transform() const { return previous_from_current; }
};
/// Ten essential matrices at most, each of which stands for four motions.
using CentralMotions = FixedVector<CentralMotion, 40>;

/// Motions of a camera in the origin that five matches allow (Nister, "An efficient solution to the
/// five-point relative pose problem", PAMI 2004). Which of the four motions of an essential matrix has the
/// points before the camera is left to the caller's errors.
void solveCentralFivePoint(const std::array<LineMatch, 5>& matches, CentralMotions* motions);

}  // namespace vcharge
