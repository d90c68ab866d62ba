#pragma once

#include <vector>

#include "vcharge_geometry/pose_graph/pose_graph.h"

namespace vcharge {

/// Result of optimizeRobustly().
struct RobustPoseGraphSummary {
  std::vector<bool> accepted;  ///< one per edge
  int num_rejected = 0;
  double noise_scale = 1.0;        ///< squared error per degree of freedom of consistent pairs of loop edges
  double final_chi_squared = 0.0;  ///< sum over the accepted edges
};

/// Optimizes a pose graph with false loop edges. Edges between nodes with consecutive numbers are odometry
/// and trusted; all others are loop edges, any of which may be false.
/// 1. Least squares on all edges. Without contradictions, continue with step 4.
/// 2. Pairwise consistency (Mangelson et al., "Pairwise consistent measurement set maximization", ICRA 2018)
/// of loop edges whose ends are few odometry steps apart: loop edges that agree with another one are the
/// initial set.
/// 3. Expectation maximization on this set with Cauchy weights c^2 / (c^2 + chi^2) and decreasing c (Lee,
/// Fraundorfer, Pollefeys, "Robust pose-graph loop-closures with expectation-maximization", IROS 2013).
/// 4. Least squares on all loop edges below a threshold, which is tightened until the set is stable.
/// Throws InputError if the odometry does not connect all nodes. Deterministic.
RobustPoseGraphSummary optimizeRobustly(PoseGraph* graph);

}  // namespace vcharge
