#include "vcharge_geometry/pose_graph/robust_pose_graph.h"

#include <cstdlib>
#include <stdexcept>
#include <string>

#include <gtest/gtest.h>

#include "vcharge_core/base/error.h"
#include "vcharge_geometry/pose_graph/g2o_file.h"

namespace vcharge {
namespace {

/// A file whose last num_false edges are false.
struct FileWithFalseLoops {
  const char* name;
  size_t num_false;
  double optimal_chi_squared;  ///< sum over the true edges
};

class FalseLoopsTest : public testing::TestWithParam<FileWithFalseLoops> {};

TEST_P(FalseLoopsTest, AreRejectedAndTheOptimumIsReached) {
  const char* data = std::getenv("VCHARGE_DATA");
  if (data == nullptr) {
    GTEST_SKIP() << "VCHARGE_DATA is not set";
  }
  PoseGraph graph = readG2o(std::string(data) + "/pose_graphs/" + GetParam().name + ".g2o");
  const RobustPoseGraphSummary summary = optimizeRobustly(InformationQuality::kUpToOneScale, &graph);
  const size_t num_true = graph.edges.size() - GetParam().num_false;
  size_t num_true_kept = 0;
  double chi_squared = 0.0;
  for (size_t i = 0; i < graph.edges.size(); ++i) {
    if (i < num_true) {
      num_true_kept += summary.accepted[i] ? 1 : 0;
      chi_squared += chiSquared(graph, graph.edges[i]);
    } else {
      EXPECT_FALSE(summary.accepted[i]) << "false edge " << i;
    }
  }
  EXPECT_GE(static_cast<double>(num_true_kept), 0.98 * static_cast<double>(num_true));
  EXPECT_NEAR(chi_squared, GetParam().optimal_chi_squared, 0.01 * GetParam().optimal_chi_squared);
}

INSTANTIATE_TEST_SUITE_P(Files, FalseLoopsTest,
                         testing::Values(FileWithFalseLoops{"garage_rand100", 100, 1.2387},
                                         FileWithFalseLoops{"intel_rand100", 100, 546.461},
                                         FileWithFalseLoops{"manhattanOlson_rand100", 100, 146.077},
                                         FileWithFalseLoops{"manhattanOlson_rand1000", 1000, 146.077},
                                         FileWithFalseLoops{"parking-garage", 0, 1.2387},
                                         FileWithFalseLoops{"intel", 0, 45.0047},
                                         FileWithFalseLoops{"manhattan", 0, 3549.04},
                                         FileWithFalseLoops{"smallGrid3D", 0, 458.154}));

TEST(RobustPoseGraphTest, NeedsConnectedOdometry) {
  PoseGraph graph;
  graph.planar = true;
  PoseGraphEdge edge;
  edge.first = 0;
  edge.second = 5;
  edge.information.setIdentity();
  graph.edges.push_back(edge);
  ASSERT_TRUE(placeNodesAlongEdges(&graph));
  EXPECT_THROW(optimizeRobustly(InformationQuality::kUpToOneScale, &graph), InputError);
}

}  // namespace
}  // namespace vcharge
