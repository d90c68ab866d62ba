#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include <Eigen/Core>

#include "vcharge_core/motion/rigid_transform.h"

namespace vcharge {

/// A measured relative pose between two nodes of a pose graph.
struct PoseGraphEdge {
  int64_t first = 0;
  int64_t second = 0;
  RigidTransform first_from_second;
  /// Information matrix of g2o's error [translation (m), vector part of the quaternion]. In planar graphs,
  /// rows and columns 0, 1 and 5 belong to [x, y, yaw (rad)]; the others are zero.
  Eigen::Matrix<double, 6, 6> information = Eigen::Matrix<double, 6, 6>::Zero();
};

/// Poses with relative measurements between them: SE(2) when planar, else SE(3).
struct PoseGraph {
  bool planar = false;
  std::map<int64_t, RigidTransform> map_from_node;
  std::vector<PoseGraphEdge> edges;
};

/// g2o's error of an edge, Z^-1 X_first^-1 X_second as [translation, vector part of the quaternion with w >=
/// 0], or [x, y, 0, 0, 0, yaw] in planar graphs.
Eigen::Matrix<double, 6, 1> errorOfEdge(const PoseGraph& graph, const PoseGraphEdge& edge);
/// Squared error of an edge, e^T information e, or the sum over all edges.
double chiSquared(const PoseGraph& graph, const PoseGraphEdge& edge);
double chiSquared(const PoseGraph& graph);

/// Replaces all poses by those along a spanning tree of the edges (breadth first from the first node).
/// Returns false if the edges do not connect all nodes.
bool placeNodesAlongEdges(PoseGraph* graph);

}  // namespace vcharge
