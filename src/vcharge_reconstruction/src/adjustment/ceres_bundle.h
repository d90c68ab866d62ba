#pragma once

#include "vcharge_reconstruction/bundle_solver.h"

namespace vcharge::testing {

/// What solveBundle() does, by Ceres.
void solveWithCeres(int max_iterations, double cost_tolerance, BundleProblem* bundle);

}  // namespace vcharge::testing
