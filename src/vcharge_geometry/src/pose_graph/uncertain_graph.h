#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "pose_graph/relative_pose.h"

namespace vcharge {

/// Poses of nodes relative to each other along the least uncertain path of edges. Nodes are 0, 1, 2...
class UncertainGraph {
 public:
  /// `lever_m`: distance at which a rotation counts like a translation when paths are compared.
  UncertainGraph(size_t num_nodes, double lever_m);

  void addEdge(size_t first, size_t second, const RelativePose& first_from_second);
  /// Removes the edges added last, until so many are left.
  void resize(size_t num_edges);
  size_t numEdges() const { return edges_.size(); }

  /// What paths are compared by: m^2, the trace of the covariance, rotations over the lever.
  double weightOf(const Matrix6d& covariance) const;

  struct Path {
    double weight;
    RelativePose first_from_second;
  };
  /// Absent if all paths are longer than the maximum.
  std::optional<Path> path(size_t first, size_t second, double max_weight) const;
  /// Least uncertain paths from a node to all nodes within the maximum, by node.
  std::vector<std::optional<Path>> pathsWithin(size_t source, double max_weight) const;
  /// Poses of all nodes along the least uncertain paths from node 0; absent for nodes without one.
  std::vector<std::optional<RigidTransform>> placed() const;

 private:
  struct Edge {
    size_t first, second;
    RelativePose first_from_second;
  };
  /// An edge as seen from one of its nodes; small, since searches read many.
  struct Arc {
    uint32_t to;
    uint32_t edge;
    double weight;
  };
  struct Reached {
    double distance;
    uint32_t from;
    uint32_t edge;
  };
  /// Shortest paths from `source`, up to `target` if there is one, by node; infinite where there is none.
  /// `order`: the nodes that were reached, from near to far.
  std::vector<Reached> search(size_t source, std::optional<size_t> target, double max_weight,
                              std::vector<uint32_t>* order = nullptr) const;
  RelativePose step(size_t from, uint32_t edge) const;

  double lever_m_;
  std::vector<Edge> edges_;
  std::vector<std::vector<Arc>> arcs_;  // by node
};

}  // namespace vcharge
