#include "vcharge_geometry/pose_graph/pose_graph.h"

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "vcharge_core/base/error.h"
#include "vcharge_geometry/pose_graph/g2o_file.h"
#include "vcharge_geometry/pose_graph/pose_graph_optimizer.h"

namespace vcharge {
namespace {

/// A file with the given text, removed by the destructor.
class TemporaryFile {
 public:
  explicit TemporaryFile(const std::string& text)
      : path_(testing::TempDir() + "vcharge_geometry_" +
              testing::UnitTest::GetInstance()->current_test_info()->name() + ".g2o") {
    std::ofstream(path_, std::ios::binary) << text;
  }
  ~TemporaryFile() {
    std::error_code ignored;
    std::filesystem::remove(path_, ignored);
  }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

const char* const kPlanarText =
    "VERTEX_SE2 0 0 0 0\n"
    "VERTEX_SE2 1 1 0.1 0.2\n"
    "VERTEX_SE2 7 2 0 0\n"
    "FIX 0\n"
    "EDGE_SE2 0 1 1 0 0.1 10 0 0 10 0 100\n"
    "EDGE_SE2 1 7 1 0 -0.1 10 1 0 10 0 100\n";

TEST(PoseGraphTest, ReadsPlanarGraphs) {
  const TemporaryFile file(kPlanarText);
  const PoseGraph graph = readG2o(file.path());
  ASSERT_TRUE(graph.planar);
  ASSERT_EQ(graph.map_from_node.size(), 3U);
  ASSERT_EQ(graph.edges.size(), 2U);
  EXPECT_EQ(graph.edges[1].information(1, 0), 1.0);
}

TEST(PoseGraphTest, NamesFileAndLineOfBadInput) {
  const std::string good = "EDGE_SE2 0 1 1 0 0 1 0 0 1 0 1\n";
  const std::vector<std::pair<std::string, std::string>> cases{
      {"EDGE_SE2 0 1 1 0 nan 1 0 0 1 0 1\n", ":2: expected a finite number"},
      {"EDGE_SE2 0 1 1 0 0 1 0 0 1 0\n", ":2: expected a finite number"},
      {"EDGE_SE2 0 1 1e999 0 0 1 0 0 1 0 1\n", ":2: expected a finite number"},
      {"EDGE_SE2 0 1 1 0 0 1 0 0 1 0 1 5\n", ":2: unexpected '5'"},
      {"EDGE_SE2 0 -1 1 0 0 1 0 0 1 0 1\n", ":2: expected the number of a node"},
      {"EDGE_SE2 0 99999999999999999999 1 0 0 1 0 0 1 0 1\n", ":2: expected the number of a node"},
      {"EDGE_SE2 1 1 1 0 0 1 0 0 1 0 1\n", ":2: an edge from a node to itself"},
      {"EDGE_SE2 0 1 1 0 0 1 9 0 1 0 1\n", ":2: expected a positive semidefinite"},
      {"EDGE_SE3:QUAT 0 1 0 0 0 0 0 0 1 1 0 0 0 0 0 1 0 0 0 0 1 0 0 0 1 0 0 1 0 1\n", ":2: SE2 and SE3"},
      {"VERTEX_SE3:QUAT 0 0 0 0 0 0 0 1\n", ":2: SE2 and SE3"},
      {"VERTEX_SE2 0 0 0 0\nVERTEX_SE2 0 0 0 0\n", ":3: node 0 is given twice"},
      {"LANDMARK 0 0\n", ":2: unknown 'LANDMARK'"},
      {"VERTEX_SE2 5 0 0 0\n", "do not connect all nodes"},
  };
  for (const auto& [line, reason] : cases) {
    const TemporaryFile file(good + line);
    try {
      readG2o(file.path());
      ADD_FAILURE() << "accepted: " << line;
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), testing::HasSubstr(file.path()));
      EXPECT_THAT(error.what(), testing::HasSubstr(reason)) << line;
    }
  }
  const TemporaryFile zero("EDGE_SE3:QUAT 0 1 0 0 0 0 0 0 0 1 0 0 0 0 0 1 0 0 0 0 1 0 0 0 1 0 0 1 0 1\n");
  EXPECT_THROW(readG2o(zero.path()), InputError);
  EXPECT_THROW(readG2o(testing::TempDir() + "no_such_file.g2o"), InputError);
}

class KnownOptimumTest : public testing::TestWithParam<std::pair<const char*, double>> {};

TEST_P(KnownOptimumTest, IsReached) {
  const char* data = std::getenv("VCHARGE_DATA");
  if (data == nullptr) {
    GTEST_SKIP() << "VCHARGE_DATA is not set";
  }
  PoseGraph graph = readG2o(std::string(data) + "/pose_graphs/" + GetParam().first + ".g2o");
  const PoseGraphSummary summary = optimizePoseGraph({}, 100, &graph);
  EXPECT_TRUE(summary.converged);
  EXPECT_NEAR(summary.final_chi_squared, GetParam().second, 1e-3 * GetParam().second);
  // The cost minimized by Ceres is the error defined in pose_graph.h.
  EXPECT_NEAR(chiSquared(graph), summary.final_chi_squared, 1e-6 * summary.final_chi_squared);
}

INSTANTIATE_TEST_SUITE_P(Files, KnownOptimumTest,
                         testing::Values(std::pair<const char*, double>("parking-garage", 1.2387),
                                         std::pair<const char*, double>("intel", 45.0047),
                                         std::pair<const char*, double>("manhattan", 3549.04),
                                         std::pair<const char*, double>("smallGrid3D", 458.154),
                                         std::pair<const char*, double>("manhattanOlson3500", 146.077),
                                         std::pair<const char*, double>("intel_vertigo", 546.461)));

TEST(PoseGraphTest, WeightsLeaveEdgesOut) {
  const TemporaryFile file(std::string(kPlanarText) + "EDGE_SE2 0 7 50 50 1 10 0 0 10 0 100\n");
  PoseGraph graph = readG2o(file.path());
  EXPECT_NEAR(optimizePoseGraph({1.0, 1.0, 0.0}, 50, &graph).final_chi_squared, 0.0, 1e-9);
  EXPECT_GT(optimizePoseGraph({}, 50, &graph).final_chi_squared, 1.0);
  EXPECT_THROW(optimizePoseGraph({1.0}, 50, &graph), std::logic_error);
}

}  // namespace
}  // namespace vcharge
