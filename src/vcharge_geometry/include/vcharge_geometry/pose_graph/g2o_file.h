#pragma once

#include <string>

#include "vcharge_geometry/pose_graph/pose_graph.h"

namespace vcharge {

/// Reads a g2o file of the public pose graphs that the optimizers are tested on: VERTEX_SE2 and EDGE_SE2, or
/// VERTEX_SE3:QUAT and EDGE_SE3:QUAT; ignores FIX. Nodes without a VERTEX line are placed along the edges.
/// Throws InputError "<path>:<line>: <reason>" for anything else.
PoseGraph readG2o(const std::string& path);

}  // namespace vcharge
