#include "vcharge_geometry/pose_graph/robust_pose_graph.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iterator>
#include <utility>

#include "vcharge_core/base/error.h"
#include "vcharge_geometry/pose_graph/pose_graph_optimizer.h"

namespace vcharge {
namespace {

/// Maximum number of odometry steps, at either end, between two loop edges that are compared.
constexpr int64_t kMaxCycleSteps = 5;
/// A loop edge above this is false if the information matrices are right.
constexpr double kMaxEdgeChiSquared = 16.0;
/// Where the information matrices understate the accuracy of edges, the threshold is this many times the
/// noise that consistent loop edges show per degree of freedom.
constexpr double kNoiseFactor = 1600.0;

bool isOdometry(const PoseGraphEdge& edge) {
  return std::abs(edge.first - edge.second) == 1;
}

/// Two loop edges whose ends are close to each other along the odometry, and the error of the cycle that they
/// form, in units of the first edge's information, per edge of the cycle.
struct LoopPair {
  size_t first;
  size_t second;
  double chi_squared_per_edge;
};

/// The graph without loop edges, with nodes placed along the odometry.
PoseGraph odometryOf(const PoseGraph& graph) {
  PoseGraph odometry = graph;
  odometry.edges.clear();
  std::copy_if(graph.edges.begin(), graph.edges.end(), std::back_inserter(odometry.edges), isOdometry);
  if (!placeNodesAlongEdges(&odometry)) {
    throw InputError("pose graph: edges between consecutive nodes do not connect all nodes");
  }
  return odometry;
}

/// All pairs of loop edges whose cycles have few odometry steps. Loop edges are indices into graph.edges.
std::vector<LoopPair> nearbyPairs(const PoseGraph& graph, const PoseGraph& odometry,
                                  const std::vector<size_t>& loops, int64_t max_steps) {
  // Sorted by the lower node, so that only neighbours need to be compared.
  struct Oriented {
    int64_t low;
    int64_t high;
    RigidTransform low_from_high;
    size_t edge;
  };
  std::vector<Oriented> oriented;
  for (const size_t i : loops) {
    const PoseGraphEdge& edge = graph.edges[i];
    const bool forward = edge.first < edge.second;
    oriented.push_back({std::min(edge.first, edge.second), std::max(edge.first, edge.second),
                        forward ? edge.first_from_second : edge.first_from_second.inverse(), i});
  }
  std::stable_sort(oriented.begin(), oriented.end(),
                   [](const Oriented& a, const Oriented& b) { return a.low < b.low; });
  const auto between = [&odometry](int64_t target, int64_t source) {
    return odometry.map_from_node.at(target).inverse() * odometry.map_from_node.at(source);
  };
  std::vector<LoopPair> pairs;
  for (size_t i = 0; i < oriented.size(); ++i) {
    const Oriented& a = oriented[i];
    for (size_t j = i + 1; j < oriented.size() && oriented[j].low - a.low <= max_steps; ++j) {
      const Oriented& b = oriented[j];
      if (std::abs(b.high - a.high) > max_steps) {
        continue;
      }
      PoseGraph two;
      two.planar = graph.planar;
      two.map_from_node[0] = RigidTransform();
      two.map_from_node[1] = between(a.low, b.low) * b.low_from_high * between(b.high, a.high);
      PoseGraphEdge edge = graph.edges[a.edge];
      edge.first = 0;
      edge.second = 1;
      edge.first_from_second = a.low_from_high;
      const auto num_edges = static_cast<double>(2 + (b.low - a.low) + std::abs(b.high - a.high));
      pairs.push_back({a.edge, b.edge, chiSquared(two, edge) / num_edges});
    }
  }
  return pairs;
}

/// Weights: 1 for odometry, Cauchy's for the loop edges in `members`, 0 for the others.
std::vector<double> cauchyWeights(const PoseGraph& graph, const std::vector<bool>& members,
                                  double c_squared) {
  std::vector<double> weights(graph.edges.size(), 0.0);
  for (size_t i = 0; i < weights.size(); ++i) {
    if (isOdometry(graph.edges[i])) {
      weights[i] = 1.0;
    } else if (members[i]) {
      weights[i] = c_squared / (c_squared + chiSquared(graph, graph.edges[i]));
    }
  }
  return weights;
}

/// Optimizes with Cauchy weights while c^2 falls from the largest error to a tenth of the threshold.
void expectationMaximization(const std::vector<bool>& members, const std::vector<size_t>& loops,
                             double threshold, PoseGraph* graph) {
  constexpr int kSteps = 10;
  double c_squared = threshold;
  for (const size_t i : loops) {
    c_squared = std::max(c_squared, members[i] ? chiSquared(*graph, graph->edges[i]) : 0.0);
  }
  for (; c_squared > 0.1 * threshold; c_squared *= 0.25) {
    optimizePoseGraph(cauchyWeights(*graph, members, c_squared), kSteps, graph);
  }
}

}  // namespace

RobustPoseGraphSummary optimizeRobustly(PoseGraph* graph) {
  constexpr int kSteps = 10;
  constexpr int kMaxRounds = 15;
  constexpr double kWidening = 2.0;
  const size_t num_edges = graph->edges.size();
  const double dimensions = graph->planar ? 3.0 : 6.0;
  std::vector<size_t> loops;
  for (size_t i = 0; i < num_edges; ++i) {
    if (!isOdometry(graph->edges[i])) {
      loops.push_back(i);
    }
  }
  const PoseGraph odometry = odometryOf(*graph);
  const std::vector<LoopPair> pairs = nearbyPairs(*graph, odometry, loops, kMaxCycleSteps);
  RobustPoseGraphSummary summary;
  if (!pairs.empty()) {
    std::vector<double> errors;
    for (const LoopPair& pair : pairs) {
      errors.push_back(pair.chi_squared_per_edge);
    }
    // The lower quartile is robust if up to three quarters of the pairs contain a false edge.
    std::nth_element(errors.begin(), errors.begin() + static_cast<std::ptrdiff_t>(errors.size() / 4),
                     errors.end());
    summary.noise_scale = std::min(1.0, errors[errors.size() / 4] / dimensions);
  }
  // Pairs are consistent within 12 standard deviations of the noise, a wide bound since the error of the
  // odometry between their ends is neglected.
  const double max_pair_error = std::min(1.0, 50.0 * summary.noise_scale) * dimensions * 3.0;
  std::vector<bool> members(num_edges, pairs.empty());
  for (const LoopPair& pair : pairs) {
    if (pair.chi_squared_per_edge < max_pair_error) {
      members[pair.first] = members[pair.second] = true;
    }
  }
  const double threshold = std::min(kMaxEdgeChiSquared, kNoiseFactor * summary.noise_scale);
  optimizePoseGraph({}, 5 * kSteps, graph);
  const bool contradiction = std::any_of(loops.begin(), loops.end(), [&](size_t i) {
    return !(chiSquared(*graph, graph->edges[i]) < kWidening * threshold);
  });
  if (contradiction) {
    graph->map_from_node = odometry.map_from_node;
    expectationMaximization(members, loops, threshold, graph);
  }
  std::vector<double> weights(num_edges, 0.0);
  // Starts with a wide threshold: a missing true edge may keep others beyond it.
  double widening = kWidening;
  for (int round = 0; round < kMaxRounds; ++round) {
    std::vector<double> next(num_edges, 1.0);
    for (const size_t i : loops) {
      next[i] = chiSquared(*graph, graph->edges[i]) < widening * threshold ? 1.0 : 0.0;
    }
    if (widening == 1.0 && next == weights) {
      break;
    }
    weights = std::move(next);
    summary.final_chi_squared = optimizePoseGraph(weights, 5 * kSteps, graph).final_chi_squared;
    widening = std::max(1.0, 0.5 * widening);
  }
  for (const double weight : weights) {
    summary.accepted.push_back(weight > 0.0);
    summary.num_rejected += weight > 0.0 ? 0 : 1;
  }
  return summary;
}

}  // namespace vcharge
