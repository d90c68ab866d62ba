#pragma once

#include <vector>

#include "vcharge_geometry/pose_graph/pose_graph.h"

namespace vcharge {

/// Options of optimizeRobustly.
struct RobustPoseGraphOptions {
  int max_cycle_steps = 5;  ///< odometry steps between two loop edges that are compared, at either end
  double max_edge_chi_squared =
      16.0;  ///< a loop edge above is false, where the information matrices are right
  /// The threshold is lowered to this many times the noise that consistent loop edges show, per degree of
  /// freedom, where the information matrices understate how exact the edges are.
  double noise_factor = 1600.0;
  void validate() const;  ///< throws std::invalid_argument naming the field
};

/// Result of optimizeRobustly().
struct RobustPoseGraphSummary {
  std::vector<bool> accepted;  ///< one per edge
  int num_rejected = 0;
  double noise_scale = 1.0;        ///< squared error per degree of freedom of consistent pairs of loop edges
  double final_chi_squared = 0.0;  ///< of the accepted edges
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
RobustPoseGraphSummary optimizeRobustly(const RobustPoseGraphOptions& options, PoseGraph* graph);

}  // namespace vcharge
