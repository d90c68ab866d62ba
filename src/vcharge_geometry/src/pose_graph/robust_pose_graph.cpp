#include "vcharge_geometry/pose_graph/robust_pose_graph.h"

#include <algorithm>
#include <cstdlib>
#include <optional>
#include <utility>

#include "pose_graph/loop_gate.h"
#include "vcharge_core/base/error.h"
#include "vcharge_geometry/pose_graph/pose_graph_optimizer.h"

namespace vcharge {
namespace {

constexpr int kMaxIterations = 50;
constexpr int kMaxRounds = 10;
/// The gate repeats while the optimum shows more noise than the gate assumed.
constexpr double kMaxScaleRatio = 1.1;
/// Real errors have longer tails than normal ones: how much larger than the largest normal one an error may
/// be where loops are tried that the gate could not predict.
constexpr double kTailFactor = 12.0;

/// Weights of all edges: 1, or 0 for loops of groups that aren't accepted.
std::vector<double> weightsOf(const PoseGraph& graph, const std::vector<GatedGroup>& groups) {
  std::vector<double> weights(graph.edges.size(), 1.0);
  for (const GatedGroup& group : groups) {
    for (const size_t i : group.loops) {
      weights[i] = group.verdict == LoopVerdict::kAccepted ? 1.0 : 0.0;
    }
  }
  return weights;
}

/// Squared error per degree of freedom, where a single edge counts for no more than a maximum. Steps
/// determine the nodes, so that only loops add degrees of freedom.
double noiseScaleOf(const PoseGraph& graph, const std::vector<double>& weights, size_t num_steps,
                    double max_chi_squared) {
  double sum = 0.0;
  size_t num_edges = 0;
  for (size_t i = 0; i < weights.size(); ++i) {
    if (weights[i] > 0.0) {
      sum += std::min(max_chi_squared, chiSquared(graph, graph.edges[i]));
      ++num_edges;
    }
  }
  const double dimensions = graph.planar ? 3.0 : 6.0;
  return sum / (dimensions * static_cast<double>(std::max<size_t>(1, num_edges - num_steps)));
}

/// Whether any edge of weight 1 has a larger squared error.
bool isAnyBeyond(const PoseGraph& graph, const std::vector<double>& weights, double max_chi_squared) {
  for (size_t i = 0; i < weights.size(); ++i) {
    if (weights[i] > 0.0 && !(chiSquared(graph, graph.edges[i]) < max_chi_squared)) {
      return true;
    }
  }
  return false;
}

/// Least squares without single loops that are rather false than true at the optimum. Returns the sum of the
/// squared errors.
double optimizeWithoutFalse(const LoopGate& gate, std::vector<double>* weights, PoseGraph* graph) {
  double sum = optimizePoseGraph(*weights, kMaxIterations, graph).final_chi_squared;
  for (int round = 0; round < kMaxRounds; ++round) {
    const std::vector<double> before = *weights;
    for (const auto& [edge, agrees] : gate.agreeing(graph->map_from_node)) {
      (*weights)[edge] = agrees ? (*weights)[edge] : 0.0;
    }
    if (*weights == before) {
      break;
    }
    sum = optimizePoseGraph(*weights, kMaxIterations, graph).final_chi_squared;
  }
  return sum;
}

/// Adds all groups for whose prediction the odometry is too uncertain, if least squares finds no
/// contradiction.
void tryUnpredicted(const std::vector<GatedGroup>& groups, double max_chi_squared,
                    std::vector<double>* weights, PoseGraph* graph) {
  std::vector<double> with = *weights;
  for (const GatedGroup& group : groups) {
    if (group.verdict == LoopVerdict::kUndecided && !group.is_predicted) {
      for (const size_t i : group.loops) {
        with[i] = 1.0;
      }
    }
  }
  if (with == *weights) {
    return;
  }
  PoseGraph tried = *graph;
  optimizePoseGraph(with, kMaxIterations, &tried);
  if (!isAnyBeyond(tried, with, max_chi_squared)) {
    *weights = std::move(with);
    *graph = std::move(tried);
  }
}

}  // namespace

RobustPoseGraphSummary optimizeRobustly(InformationQuality quality, PoseGraph* graph) {
  std::vector<size_t> odometry;
  std::vector<size_t> loops;
  for (size_t i = 0; i < graph->edges.size(); ++i) {
    (std::abs(graph->edges[i].first - graph->edges[i].second) == 1 ? odometry : loops).push_back(i);
  }
  RobustPoseGraphSummary summary;
  if (loops.empty()) {
    if (!placeNodesAlongEdges(graph)) {
      throw InputError("pose graph: edges between consecutive nodes do not connect all nodes");
    }
    summary.accepted.assign(graph->edges.size(), true);
    summary.undecided.assign(graph->edges.size(), false);
    return summary;
  }
  std::optional<double> noise_scale;
  if (quality == InformationQuality::kRight) {
    noise_scale = 1.0;
  }
  std::optional<LoopGate> gate;
  std::vector<double> weights;
  for (int round = 0; round < kMaxRounds; ++round) {
    gate.emplace(*graph, odometry, loops, noise_scale);
    gate->decide();
    graph->map_from_node = gate->placed();
    do {
      weights = weightsOf(*graph, gate->groups());
      summary.final_chi_squared = optimizeWithoutFalse(*gate, &weights, graph);
    } while (gate->hearAgain(graph->map_from_node));
    noise_scale = noiseScaleOf(*graph, weights, odometry.size(),
                               maxConsistentChiSquared(graph->planar) * gate->noiseScale());
    if (*noise_scale < kMaxScaleRatio * gate->noiseScale()) {
      break;
    }
  }
  summary.noise_scale = gate->noiseScale();
  const double max_chi_squared = kTailFactor * maxConsistentChiSquared(graph->planar) * gate->noiseScale();
  tryUnpredicted(gate->groups(), max_chi_squared, &weights, graph);
  summary.final_chi_squared = optimizeWithoutFalse(*gate, &weights, graph);
  for (const double weight : weights) {
    summary.accepted.push_back(weight > 0.0);
    summary.num_rejected += weight > 0.0 ? 0 : 1;
  }
  summary.undecided.assign(graph->edges.size(), false);
  for (const GatedGroup& group : gate->groups()) {
    for (const size_t i : group.loops) {
      summary.undecided[i] = group.verdict == LoopVerdict::kUndecided && !summary.accepted[i];
    }
  }
  return summary;
}

}  // namespace vcharge
