#pragma once

#include <vector>

#include "vcharge_core/motion/rigid_transform.h"
#include "vcharge_geometry/solvers/pluecker_line.h"
#include "vcharge_geometry/solvers/solver_status.h"

namespace vcharge {

/// Motion of a generalized camera from 17 or more line matches, linear: Pless, "Using many cameras as one",
/// CVPR 2003, solved as in Li, Hartley, Kim, "A linear approach to motion estimation using generalized camera
/// models", CVPR 2008, so that it also holds when every point is seen by the same camera in both frames (E =
/// 0, R = I is then a false solution). The baseline of the paper; it takes any motion and no wrong match.
///
/// The constraint of pluecker_line.h is linear in E = [t]x R and R. The entries of R are projected out, E is
/// the singular vector of what remains, and t with its scale is the least-squares solution for the rotation
/// of the two in E that leaves the smaller residual. `previous_from_current` is written for kOk only.
/// kDegenerate with fewer than 17 matches, or where E or t is not unique.
SolverStatus solveLinearSeventeenPoint(const std::vector<LineMatch>& matches,
                                       RigidTransform* previous_from_current);

}  // namespace vcharge
