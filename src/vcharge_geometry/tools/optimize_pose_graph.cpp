#include <cstdio>
#include <string>

#include "vcharge_core/base/command_line.h"
#include "vcharge_core/files/file_io.h"
#include "vcharge_geometry/pose_graph/pose_graph_optimizer.h"
#include "vcharge_geometry/pose_graph/robust_pose_graph.h"

namespace {

using namespace vcharge;

struct Arguments {
  std::string input, output, rejected;
  bool trust_all = false;
};

void optimize(const Arguments& arguments, const RobustPoseGraphOptions& options, nlohmann::json* found) {
  PoseGraph graph = readG2o(arguments.input);
  const double initial_chi_squared = chiSquared(graph);
  std::printf("%zu nodes, %zu edges, chi2 %.6g\n", graph.map_from_node.size(), graph.edges.size(),
              initial_chi_squared);
  RobustPoseGraphSummary summary;
  if (arguments.trust_all) {
    constexpr int kMaxIterations = 200;
    summary.final_chi_squared = optimizePoseGraph({}, kMaxIterations, &graph).final_chi_squared;
    summary.accepted.assign(graph.edges.size(), true);
  } else {
    summary = optimizeRobustly(options, &graph);
  }
  std::printf("chi2 %.6g, %d edges rejected\n", summary.final_chi_squared, summary.num_rejected);
  PoseGraph result = graph;
  result.edges.clear();
  std::string rejected;
  for (size_t i = 0; i < graph.edges.size(); ++i) {
    const PoseGraphEdge& edge = graph.edges[i];
    if (summary.accepted[i]) {
      result.edges.push_back(edge);
    } else {
      rejected +=
          std::to_string(i) + ' ' + std::to_string(edge.first) + ' ' + std::to_string(edge.second) + '\n';
    }
  }
  writeG2o(result, arguments.output);
  if (!arguments.rejected.empty()) {
    writeTextFileAtomically(arguments.rejected, rejected);
  }
  *found = {{"num_nodes", graph.map_from_node.size()},
            {"num_edges", graph.edges.size()},
            {"num_rejected_edges", summary.num_rejected},
            {"initial_chi_squared", initial_chi_squared},
            {"final_chi_squared", summary.final_chi_squared}};
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Optimizes a pose graph (g2o, SE2 or SE3) and rejects false loop closures.");
  Arguments arguments;
  RobustPoseGraphOptions options;
  app.add_option("--input", arguments.input, "pose graph to read, g2o")->required();
  app.add_option("--output", arguments.output, "optimized pose graph with the accepted edges, g2o")
      ->required()
      ->check(requireOutput);
  app.add_option("--rejected", arguments.rejected,
                 "text file for the rejected edges: index, first, second node")
      ->check(requireOutput);
  app.add_option("--max-edge-chi-squared", options.max_edge_chi_squared, "a loop edge above is false")
      ->capture_default_str();
  app.add_flag("--trust-all", arguments.trust_all, "plain least squares: no edge is rejected");
  app.footer(
      "Keys of --json: num_nodes, num_edges, num_rejected_edges, initial_chi_squared, final_chi_squared.");
  return runTool(&app, argc, argv, [&](nlohmann::json* found) { optimize(arguments, options, found); });
}
