#include "pose_graph/uncertain_graph.h"

#include <limits>
#include <queue>
#include <utility>

namespace vcharge {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

}  // namespace

UncertainGraph::UncertainGraph(size_t num_nodes, double lever_m) : lever_m_(lever_m), arcs_(num_nodes) {}

void UncertainGraph::addEdge(size_t first, size_t second, const RelativePose& first_from_second) {
  // One weight for both directions, so that a path is as long as its inverse.
  const double weight =
      0.5 * (weightOf(first_from_second.covariance) + weightOf(inverseOf(first_from_second).covariance));
  const auto edge = static_cast<uint32_t>(edges_.size());
  arcs_[first].push_back({static_cast<uint32_t>(second), edge, weight});
  arcs_[second].push_back({static_cast<uint32_t>(first), edge, weight});
  edges_.push_back({first, second, first_from_second});
}

void UncertainGraph::resize(size_t num_edges) {
  for (; edges_.size() > num_edges; edges_.pop_back()) {
    arcs_[edges_.back().first].pop_back();
    arcs_[edges_.back().second].pop_back();
  }
}

RelativePose UncertainGraph::step(size_t from, uint32_t edge) const {
  const Edge& taken = edges_[edge];
  return taken.first == from ? taken.first_from_second : inverseOf(taken.first_from_second);
}

double UncertainGraph::weightOf(const Matrix6d& covariance) const {
  const auto variances = covariance.diagonal();
  return variances.head<3>().sum() + lever_m_ * lever_m_ * variances.tail<3>().sum();
}

std::vector<UncertainGraph::Reached> UncertainGraph::search(size_t source, std::optional<size_t> target,
                                                            double max_weight,
                                                            std::vector<uint32_t>* order) const {
  std::vector<Reached> reached(arcs_.size(), {kInfinity, 0, 0});
  using Entry = std::pair<double, uint32_t>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open;
  reached[source].distance = 0.0;
  open.emplace(0.0, static_cast<uint32_t>(source));
  while (!open.empty()) {
    const auto [distance, node] = open.top();
    open.pop();
    if (target && node == *target) {
      break;
    }
    if (distance > reached[node].distance) {
      continue;
    }
    if (order != nullptr) {
      order->push_back(node);
    }
    for (const Arc& arc : arcs_[node]) {
      const double through = distance + arc.weight;
      if (through <= max_weight && through < reached[arc.to].distance) {
        reached[arc.to] = {through, node, arc.edge};
        open.emplace(through, arc.to);
      }
    }
  }
  return reached;
}

std::optional<UncertainGraph::Path> UncertainGraph::path(size_t first, size_t second,
                                                         double max_weight) const {
  const std::vector<Reached> reached = search(first, second, max_weight);
  if (reached[second].distance == kInfinity) {
    return std::nullopt;
  }
  std::vector<size_t> nodes;
  for (size_t node = second; node != first; node = reached[node].from) {
    nodes.push_back(node);
  }
  Path path{reached[second].distance, RelativePose()};
  for (auto node = nodes.rbegin(); node != nodes.rend(); ++node) {
    path.first_from_second = path.first_from_second * step(reached[*node].from, reached[*node].edge);
  }
  return path;
}

std::vector<std::optional<UncertainGraph::Path>> UncertainGraph::pathsWithin(size_t source,
                                                                             double max_weight) const {
  std::vector<uint32_t> order;
  const std::vector<Reached> reached = search(source, std::nullopt, max_weight, &order);
  std::vector<std::optional<Path>> paths(arcs_.size());
  for (const uint32_t node : order) {
    const auto& [distance, from, edge] = reached[node];
    paths[node] = node == source ? Path{0.0, RelativePose()}
                                 : Path{distance, paths[from]->first_from_second * step(from, edge)};
  }
  return paths;
}

std::vector<std::optional<RigidTransform>> UncertainGraph::placed() const {
  std::vector<uint32_t> order;
  const std::vector<Reached> reached = search(0, std::nullopt, kInfinity, &order);
  std::vector<std::optional<RigidTransform>> placed(arcs_.size());
  for (const uint32_t node : order) {
    const Reached& last = reached[node];
    placed[node] =
        node == 0 ? RigidTransform() : *placed[last.from] * step(last.from, last.edge).first_from_second;
  }
  return placed;
}

}  // namespace vcharge
