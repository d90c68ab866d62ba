#include "vcharge_reconstruction/live_view.h"

#include <algorithm>

#include <gtest/gtest.h>

#include "vcharge_reconstruction/testing/test_drive.h"

namespace vcharge {
namespace {

TEST(LiveViewTest, ShowsThePathAndRecentLandmarks) {
  ReconstructionState state;
  state.data = testing::makeTestDrive(testing::TestDriveOptions());
  std::vector<Eigen::Vector3d> truth;
  for (Track& track : state.data.tracks) {
    if (track.observations.back().keyframe >= 30) {
      truth.push_back(*track.position_m);
    }
    track.position_m.reset();  // tracks have no position while driving
  }
  const Trajectory path = keyframePath(state);
  ASSERT_EQ(path.size(), 40U);
  EXPECT_EQ(path[7].stamp, state.data.keyframes[7].stamp);
  EXPECT_EQ(path[7].world_from_vehicle.matrix(), state.data.keyframes[7].map_from_vehicle.matrix());

  const std::vector<Eigen::Vector3d> points = recentLandmarks(state, TriangulationOptions(), 10);
  EXPECT_GT(points.size(), truth.size() / 2);
  EXPECT_LE(points.size(), truth.size());
  for (const Eigen::Vector3d& point : points) {
    const auto nearest = std::min_element(truth.begin(), truth.end(), [&](const auto& a, const auto& b) {
      return (a - point).norm() < (b - point).norm();
    });
    EXPECT_LT((*nearest - point).norm(), 1e-3);  // exact observations
  }
  EXPECT_TRUE(recentLandmarks(ReconstructionState(), TriangulationOptions(), 10).empty());
}

}  // namespace
}  // namespace vcharge
