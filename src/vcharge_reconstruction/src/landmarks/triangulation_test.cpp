#include "vcharge_reconstruction/landmarks/triangulation.h"

#include <cmath>

#include <gtest/gtest.h>

#include "vcharge_reconstruction/testing/test_drive.h"

namespace vcharge {
namespace {

Ray rayTo(const Eigen::Vector3d& origin_m, const Eigen::Vector3d& point_m) {
  return {origin_m, (point_m - origin_m).normalized()};
}

TEST(TriangulationTest, FindsTheIntersectionOfRays) {
  const Eigen::Vector3d point(3.0, -2.0, 1.0);
  const std::vector<Ray> rays = {rayTo({0.0, 0.0, 0.0}, point), rayTo({1.0, 0.0, 0.0}, point),
                                 rayTo({2.0, 0.5, 0.2}, point)};
  const auto found = triangulate(rays, TriangulationOptions());
  ASSERT_TRUE(found.has_value());
  EXPECT_LT((*found - point).norm(), 1e-9);
}

TEST(TriangulationTest, RefusesParallelDivergingSkewOrTooFewRays) {
  const TriangulationOptions options;
  const Eigen::Vector3d point(3.0, -2.0, 1.0);
  const Ray first = rayTo({0.0, 0.0, 0.0}, point);
  EXPECT_FALSE(triangulate({first, {Eigen::Vector3d(1.0, 0.0, 0.0), first.direction}}, options));
  const Ray second = rayTo({2.0, 0.0, 0.0}, point);
  EXPECT_TRUE(triangulate({first, second}, options));
  EXPECT_FALSE(
      triangulate({{first.origin_m, -first.direction}, {second.origin_m, -second.direction}}, options));
  EXPECT_FALSE(triangulate({first, rayTo({2.0, 0.0, 0.0}, point + Eigen::Vector3d(0.0, 0.0, 0.3))}, options));
  EXPECT_FALSE(triangulate({first}, options));
  EXPECT_FALSE(triangulate({}, options));
}

TEST(TriangulationTest, IgnoresOneWrongObservationOfATrack) {
  ReconstructionData data = testing::makeTestDrive(testing::TestDriveOptions());
  const std::vector<Track> truth = data.tracks;
  for (Track& track : data.tracks) {
    track.position_m.reset();
    track.observations.front().position_px.x() += 25.0;
  }
  triangulateTracks(TriangulationOptions(), &data);
  int found = 0, right = 0;
  for (size_t i = 0; i < data.tracks.size(); ++i) {
    if (data.tracks[i].position_m && truth[i].observations.size() >= 5) {
      ++found;
      right += (*data.tracks[i].position_m - *truth[i].position_m).norm() < 1e-3 ? 1 : 0;
    }
  }
  EXPECT_GT(found, 100);
  EXPECT_GT(right, 0.98 * found) << "where parallax is small, one wrong ray may outvote the others";
}

}  // namespace
}  // namespace vcharge
