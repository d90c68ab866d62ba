#include <cstdio>
#include <exception>
#include <string>

#include <CLI/CLI.hpp>

#include "vcharge_core/files/file_io.h"
#include "vcharge_geometry/pose_graph/pose_graph_optimizer.h"
#include "vcharge_geometry/pose_graph/robust_pose_graph.h"

int main(int argc, char** argv) {
  CLI::App app("Optimizes a pose graph (g2o, SE2 or SE3) and rejects false loop closures.");
  std::string input;
  std::string output;
  std::string rejected_path;
  bool trust_all = false;
  vcharge::RobustPoseGraphOptions options;
  app.add_option("--input", input, "pose graph to read, g2o")->required();
  app.add_option("--output", output, "pose graph with the found poses and the accepted edges, g2o")
      ->required();
  app.add_option("--rejected", rejected_path, "text file for the rejected edges: index, first, second node");
  app.add_option("--max-edge-chi-squared", options.max_edge_chi_squared, "a loop edge above is false")
      ->capture_default_str();
  app.add_flag("--trust-all", trust_all, "plain least squares: no edge is rejected");
  CLI11_PARSE(app, argc, argv);
  try {
    vcharge::PoseGraph graph = vcharge::readG2o(input);
    std::printf("%zu nodes, %zu edges, chi2 %.6g\n", graph.map_from_node.size(), graph.edges.size(),
                vcharge::chiSquared(graph));
    vcharge::RobustPoseGraphSummary summary;
    if (trust_all) {
      constexpr int kMaxIterations = 200;
      summary.final_chi_squared = vcharge::optimizePoseGraph({}, kMaxIterations, &graph).final_chi_squared;
      summary.accepted.assign(graph.edges.size(), true);
    } else {
      summary = vcharge::optimizeRobustly(options, &graph);
    }
    std::printf("chi2 %.6g, %d edges rejected\n", summary.final_chi_squared, summary.num_rejected);
    vcharge::PoseGraph result = graph;
    result.edges.clear();
    std::string rejected;
    for (size_t i = 0; i < graph.edges.size(); ++i) {
      const vcharge::PoseGraphEdge& edge = graph.edges[i];
      if (summary.accepted[i]) {
        result.edges.push_back(edge);
      } else {
        rejected +=
            std::to_string(i) + ' ' + std::to_string(edge.first) + ' ' + std::to_string(edge.second) + '\n';
      }
    }
    vcharge::writeG2o(result, output);
    if (!rejected_path.empty()) {
      vcharge::writeTextFileAtomically(rejected_path, rejected);
    }
  } catch (const std::exception& error) {
    std::fprintf(stderr, "optimize_pose_graph: %s\n", error.what());
    return 1;
  }
  return 0;
}
