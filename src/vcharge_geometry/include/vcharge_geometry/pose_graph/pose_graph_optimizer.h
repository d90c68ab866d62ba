#pragma once

#include <vector>

#include "vcharge_geometry/pose_graph/pose_graph.h"

namespace vcharge {

/// Result of optimizePoseGraph().
struct PoseGraphSummary {
  bool converged = false;
  double initial_chi_squared = 0.0;
  double final_chi_squared = 0.0;  ///< sum of the weighted errors
  int num_iterations = 0;
};

/// Minimizes the weighted sum of chiSquared(edge) over all nodes except the first, which is fixed. `weights`:
/// one per edge, where 0 excludes an edge; empty for all 1. Levenberg-Marquardt (Ceres) in one thread,
/// deterministic. Throws std::logic_error if the number of weights is wrong.
PoseGraphSummary optimizePoseGraph(const std::vector<double>& weights, int max_iterations, PoseGraph* graph);

}  // namespace vcharge
