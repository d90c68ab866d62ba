#include <algorithm>
#include <chrono>
#include <cstdio>

#include "tool_arguments.h"
#include "vcharge_geometry/pose_graph/g2o_file.h"
#include "vcharge_geometry/pose_graph/pose_graph_optimizer.h"
#include "vcharge_geometry/pose_graph/robust_pose_graph.h"

namespace {

using namespace vcharge;

/// Least squares over the true edges, from where a graph stands.
double optimumFrom(PoseGraph graph) {
  constexpr int kMaxIterations = 100;
  return optimizePoseGraph({}, kMaxIterations, &graph).final_chi_squared;
}

}  // namespace

int main(int argc, char** argv) {
  CommandLine app(
      "Robust optimization of a pose graph whose last edges are false: squared errors of the true edges "
      "against "
      "those of least squares without false ones, and false edges that were kept.");
  std::string path;
  size_t num_false = 0;
  app.addOption("--graph", &path, "g2o file").required();
  app.addOption("--num-false", &num_false, "how many edges at the end of the file are false");
  describeJson(&app,
               R"(kind: "pose_graph"; num_nodes, num_edges, num_false, num_false_kept, num_true_rejected,
chi_squared: sum of the squared errors of the true edges, optimum: the least that least squares reaches without the
false edges, from the result and from the file's poses; seconds of the robust optimization.)");
  return runTool(&app, argc, argv, [&](nlohmann::json* found) {
    PoseGraph graph = readG2o(path);
    if (num_false >= graph.edges.size()) {
      throw InputError("--num-false: expected fewer than the " + std::to_string(graph.edges.size()) +
                       " edges of " + path);
    }
    PoseGraph without_false = graph;
    without_false.edges.resize(graph.edges.size() - num_false);
    const size_t num_true = without_false.edges.size();
    double optimum = optimumFrom(without_false);
    const auto start = std::chrono::steady_clock::now();
    const RobustPoseGraphSummary summary = optimizeRobustly(InformationQuality::kUpToOneScale, &graph);
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    without_false.map_from_node = graph.map_from_node;
    const double chi_squared = chiSquared(without_false);
    optimum = std::min(optimum, optimumFrom(without_false));
    const auto accepted = summary.accepted.begin();
    const auto middle = accepted + static_cast<std::ptrdiff_t>(num_true);
    const auto num_false_kept = std::count(middle, summary.accepted.end(), true);
    const auto num_true_rejected = std::count(accepted, middle, false);
    std::printf(
        "%s: %zu nodes, %zu true edges, of which %zd rejected, %zu false edges, of which %zd kept; squared "
        "error "
        "%.6g, optimum %.6g; %.2f s\n",
        path.c_str(), graph.map_from_node.size(), num_true, num_true_rejected, num_false, num_false_kept,
        chi_squared, optimum, seconds);
    *found = {{"kind", "pose_graph"},
              {"num_nodes", graph.map_from_node.size()},
              {"num_edges", graph.edges.size()},
              {"num_false", num_false},
              {"num_false_kept", num_false_kept},
              {"num_true_rejected", num_true_rejected},
              {"chi_squared", chi_squared},
              {"optimum", optimum},
              {"seconds", seconds}};
  });
}
