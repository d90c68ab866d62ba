#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "pose_graph/relative_pose.h"

namespace vcharge {

/// A loop between nodes that are numbered along the odometry, first < second.
struct OrderedLoop {
  size_t first;
  size_t second;
  RelativePose measured;
};

/// Loops of one place that agree with each other, as indices.
struct LoopGroups {
  std::vector<std::vector<size_t>> groups;
  /// Squared error per degree of freedom of loops that agree; at most 1.
  double noise_scale = 1.0;
};

/// Error of a consistent measurement, beyond which chance comes once in a million times.
double maxConsistentChiSquared(bool planar);

/// `steps[i]`: pose of node i + 1 relative to node i.
LoopGroups groupLoops(const std::vector<OrderedLoop>& loops, const std::vector<RelativePose>& steps,
                      bool planar, std::optional<double> noise_scale);

}  // namespace vcharge
