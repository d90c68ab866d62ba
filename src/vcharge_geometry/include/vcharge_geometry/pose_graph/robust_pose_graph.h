#pragma once

#include <vector>

#include "vcharge_geometry/pose_graph/pose_graph.h"

namespace vcharge {

/// Result of optimizeRobustly().
struct RobustPoseGraphSummary {
  std::vector<bool> accepted;  ///< one per edge
  /// Edges that are not accepted since the others predict too little to tell whether they are true.
  std::vector<bool> undecided;
  int num_rejected = 0;
  double noise_scale = 1.0;        ///< factor on the covariances that edges show
  double final_chi_squared = 0.0;  ///< sum over the accepted edges
};

/// What the information matrices of a graph are worth.
enum class InformationQuality {
  kRight,         ///< those of the edges' errors, odometry with all of its drift
  kUpToOneScale,  ///< one factor is missing, which neighbouring loops tell
};

/// Optimizes a pose graph with false loop edges. Edges between nodes with consecutive numbers are odometry
/// and trusted; all others are loop edges, any of which may be false, alone or in groups that agree with each
/// other.
/// 1. Loops are accepted or not by consistency with the odometry and each other, before any is optimized:
/// groups of neighbouring loops, the most certain first, against the least uncertain path between their ends.
/// 2. Least squares over the odometry and accepted loops. Groups that were not accepted are heard again at
/// the optimum, which did not need them.
/// 3. Loops whose prediction is too uncertain for step 1 are added together if least squares finds no
/// contradiction, and single loops are dropped that are far off in a group. Throws InputError if the odometry
/// does not connect all nodes. Deterministic.
RobustPoseGraphSummary optimizeRobustly(InformationQuality quality, PoseGraph* graph);

}  // namespace vcharge
