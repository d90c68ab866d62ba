#pragma once

#include "vcharge_reconstruction/bundle_solver.h"

namespace vcharge::testing {

/// Solves the problem of solveBundle() with Ceres on one thread; ground observations and a free first pose
/// are not supported.
void solveWithCeres(int max_iterations, double cost_tolerance, BundleProblem* bundle);

}  // namespace vcharge::testing
