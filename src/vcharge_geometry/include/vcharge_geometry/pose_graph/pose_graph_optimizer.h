#pragma once

#include <vector>

#include "vcharge_geometry/pose_graph/pose_graph.h"

namespace vcharge {

/// What optimizePoseGraph reached.
struct PoseGraphSummary {
  bool converged = false;
  double initial_chi_squared = 0.0;
  double final_chi_squared = 0.0;  ///< weighted
  int num_iterations = 0;
};

/// Moves the nodes to the least weighted sum of chiSquared(edge), the first node held. weights: one per edge,
/// 0 leaves an edge out; empty means 1 for all. Levenberg-Marquardt (Ceres), one thread, deterministic.
/// std::logic_error when the number of weights is wrong.
PoseGraphSummary optimizePoseGraph(const std::vector<double>& weights, int max_iterations, PoseGraph* graph);

}  // namespace vcharge
