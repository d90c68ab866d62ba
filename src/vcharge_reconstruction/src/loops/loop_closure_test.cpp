#include "vcharge_reconstruction/loop_closure.h"

#include <gtest/gtest.h>

#include "vcharge_reconstruction/testing/test_drive.h"

namespace vcharge {
namespace {

LoopEdge edgeBetween(const ReconstructionData& data, int32_t first, int32_t second,
                     const RigidTransform& error) {
  LoopEdge edge;
  edge.first = first;
  edge.second = second;
  edge.first_from_second =
      data.keyframes[first].map_from_vehicle.inverse() * data.keyframes[second].map_from_vehicle * error;
  edge.num_inliers = 30;
  edge.covariance.diagonal() << 1e-4, 1e-4, 1e-4, 1e-6, 1e-6, 1e-6;
  return edge;
}

TEST(LoopClosureTest, RejectsEdgesThatContradictTheAdjustedMap) {
  const ReconstructionData data = testing::makeTestDrive({});
  std::vector<LoopEdge> edges = {
      edgeBetween(data, 0, 30, RigidTransform::planar(0.05, 0.02, 0.005)),
      edgeBetween(data, 1, 31, RigidTransform::planar(0.3, 0.0, 0.0)),
      edgeBetween(data, 2, 32, RigidTransform::planar(0.0, 0.0, 0.05)),
      edgeBetween(data, 3, 33, RigidTransform::planar(5.0, 0.0, 0.0)),
  };
  edges[0].accepted = edges[1].accepted = edges[2].accepted = true;
  edges[3].reason = "too few landmarks agree";
  checkLoops(data, &edges);
  EXPECT_TRUE(edges[0].accepted);
  EXPECT_TRUE(edges[0].reason.empty());
  EXPECT_FALSE(edges[1].accepted);
  EXPECT_EQ(edges[1].reason, "contradicts the adjusted map");
  EXPECT_FALSE(edges[2].accepted);
  EXPECT_EQ(edges[3].reason, "too few landmarks agree") << "a reason that is there stays";
}

TEST(LoopClosureTest, MovesTheKeyframesAndRejectsAWrongEdge) {
  const ReconstructionData truth = testing::makeTestDrive({});
  ReconstructionData data = truth;
  // Chained motions that turn a little too much.
  for (size_t i = 1; i < data.keyframes.size(); ++i) {
    const RigidTransform step =
        truth.keyframes[i - 1].map_from_vehicle.inverse() * truth.keyframes[i].map_from_vehicle;
    data.keyframes[i].map_from_vehicle =
        data.keyframes[i - 1].map_from_vehicle * step * RigidTransform::planar(0.0, 0.0, 0.0005);
  }
  std::vector<LoopEdge> edges;
  for (int32_t i = 0; i < 6; ++i) {
    edges.push_back(edgeBetween(truth, i, 34 + i, RigidTransform()));
  }
  edges.push_back(edgeBetween(truth, 3, 38, RigidTransform::planar(2.0, -1.0, 0.3)));
  const auto errorAtEnd = [&] {
    return (data.keyframes.back().map_from_vehicle.translation() -
            truth.keyframes.back().map_from_vehicle.translation())
        .norm();
  };
  const double before_m = errorAtEnd();
  closeLoops(&edges, &data);
  EXPECT_GT(before_m, 0.1);
  EXPECT_LT(errorAtEnd(), 0.2 * before_m);
  for (size_t i = 0; i < 6; ++i) {
    EXPECT_TRUE(edges[i].accepted) << i;
  }
  EXPECT_FALSE(edges[6].accepted);
  EXPECT_EQ(edges[6].reason, "contradicts the other edges");
}

}  // namespace
}  // namespace vcharge
