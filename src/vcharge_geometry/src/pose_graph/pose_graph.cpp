#include "vcharge_geometry/pose_graph/pose_graph.h"

#include <cmath>
#include <queue>

namespace vcharge {

Eigen::Matrix<double, 6, 1> errorOfEdge(const PoseGraph& graph, const PoseGraphEdge& edge) {
  const RigidTransform difference = edge.first_from_second.inverse() *
                                    graph.map_from_node.at(edge.first).inverse() *
                                    graph.map_from_node.at(edge.second);
  Eigen::Matrix<double, 6, 1> error;
  if (graph.planar) {
    error << difference.translation().head<2>(), 0.0, 0.0, 0.0, yawOfRotation(difference.rotation());
  } else {
    const double sign = difference.rotation().w() < 0.0 ? -1.0 : 1.0;
    error << difference.translation(), sign * difference.rotation().vec();
  }
  return error;
}

double chiSquared(const PoseGraph& graph, const PoseGraphEdge& edge) {
  const Eigen::Matrix<double, 6, 1> error = errorOfEdge(graph, edge);
  return error.dot(edge.information * error);
}

double chiSquared(const PoseGraph& graph) {
  double sum = 0.0;
  for (const PoseGraphEdge& edge : graph.edges) {
    sum += chiSquared(graph, edge);
  }
  return sum;
}

bool placeNodesAlongEdges(PoseGraph* graph) {
  std::map<int64_t, std::vector<const PoseGraphEdge*>> edges_of_node;
  for (const PoseGraphEdge& edge : graph->edges) {
    edges_of_node[edge.first].push_back(&edge);
    edges_of_node[edge.second].push_back(&edge);
  }
  for (const auto& [node, pose] : graph->map_from_node) {
    edges_of_node[node];
  }
  if (edges_of_node.empty()) {
    return true;
  }
  std::map<int64_t, RigidTransform> placed;
  const int64_t root = edges_of_node.begin()->first;
  const auto known_root = graph->map_from_node.find(root);
  placed[root] = known_root == graph->map_from_node.end() ? RigidTransform() : known_root->second;
  std::queue<int64_t> open;
  open.push(root);
  while (!open.empty()) {
    const int64_t node = open.front();
    open.pop();
    const RigidTransform map_from_node = placed.at(node);
    for (const PoseGraphEdge* edge : edges_of_node.at(node)) {
      const bool forward = edge->first == node;
      const int64_t neighbour = forward ? edge->second : edge->first;
      const RigidTransform map_from_neighbour =
          map_from_node * (forward ? edge->first_from_second : edge->first_from_second.inverse());
      if (placed.emplace(neighbour, map_from_neighbour).second) {
        open.push(neighbour);
      }
    }
  }
  const bool connected = placed.size() == edges_of_node.size();
  graph->map_from_node = std::move(placed);
  return connected;
}

}  // namespace vcharge
