#include "vcharge_ros/sparse_map_conversions.h"

#include <cmath>

#include <gtest/gtest.h>
#include <sensor_msgs/point_cloud2_iterator.h>

#include "vcharge_core/sparse_map/analytic_map.h"
#include "vcharge_ros/conversions.h"

namespace vcharge {
namespace {

TEST(SparseMapConversionsTest, CloudHasTheLandmarksInOrder) {
  SparseMapContents contents = makeAnalyticMap();
  contents.landmarks[3].covariance_m2.setZero();
  const SparseMap map(contents);
  const sensor_msgs::PointCloud2 cloud = makeLandmarkCloud(map);
  EXPECT_EQ(cloud.header.frame_id, "map");
  ASSERT_EQ(cloud.width * cloud.height, map.landmarks().size());
  EXPECT_EQ(cloud.data.size(), cloud.row_step * cloud.height);
  sensor_msgs::PointCloud2ConstIterator<float> x(cloud, "x"), z(cloud, "z"), count(cloud, "observations"),
      sigma(cloud, "sigma_m");
  for (size_t i = 0; i < map.landmarks().size(); ++i, ++x, ++z, ++count, ++sigma) {
    const auto [begin, end] = map.observationsOfLandmark(i);
    EXPECT_EQ(*x, static_cast<float>(map.landmarks()[i].position_m.x()));
    EXPECT_EQ(*z, static_cast<float>(map.landmarks()[i].position_m.z()));
    EXPECT_EQ(*count, static_cast<float>(end - begin));
    if (i == 3) {
      EXPECT_TRUE(std::isnan(*sigma));
    } else {
      EXPECT_NEAR(*sigma, std::sqrt(map.landmarks()[i].covariance_m2.trace()), 1e-6);
    }
  }
}

TEST(SparseMapConversionsTest, PointsOfAnUnfinishedMapHaveTheSameFields) {
  const std::vector<Eigen::Vector3d> points = {{1.0, 2.0, 3.0}, {-4.0, 0.5, 0.25}};
  const sensor_msgs::PointCloud2 cloud = makeLandmarkCloud(points, "other");
  const sensor_msgs::PointCloud2 finished = makeLandmarkCloud(SparseMap(makeAnalyticMap()));
  EXPECT_EQ(cloud.header.frame_id, "other");
  ASSERT_EQ(cloud.width * cloud.height, 2U);
  ASSERT_EQ(cloud.fields.size(), finished.fields.size());
  EXPECT_EQ(cloud.point_step, finished.point_step);
  sensor_msgs::PointCloud2ConstIterator<float> x(cloud, "x"), y(cloud, "y"), z(cloud, "z"),
      count(cloud, "observations");
  for (const Eigen::Vector3d& point : points) {
    EXPECT_EQ(Eigen::Vector3d(*x, *y, *z), point);  // exact in single precision
    EXPECT_TRUE(std::isnan(*count));
    ++x, ++y, ++z, ++count;
  }
}

TEST(SparseMapConversionsTest, PathHasPosesAndStampsOfTheKeyframes) {
  const SparseMap map(makeAnalyticMap());
  const nav_msgs::Path path = makePath(map, "other");
  EXPECT_EQ(path.header.frame_id, "other");
  ASSERT_EQ(path.poses.size(), map.keyframes().size());
  for (size_t i = 0; i < path.poses.size(); ++i) {
    EXPECT_EQ(toTimestamp(path.poses[i].header.stamp), map.keyframes()[i].stamp);
    EXPECT_EQ(path.poses[i].header.frame_id, "other");
    const RigidTransform map_from_vehicle = fromMessage(path.poses[i].pose, "path");
    EXPECT_LT((map_from_vehicle.translation() - map.keyframes()[i].map_from_vehicle.translation()).norm(),
              1e-12);
    EXPECT_LT(angleOfRotation(map_from_vehicle.rotation().conjugate() *
                              map.keyframes()[i].map_from_vehicle.rotation()),
              1e-7);
  }
}

TEST(SparseMapConversionsTest, AcceptedAndRejectedLoopEdgesAreSeparateMarkers) {
  SparseMapContents contents = makeAnalyticMap();
  const visualization_msgs::MarkerArray array = makeLoopEdgeMarkers(SparseMap(contents));
  ASSERT_EQ(array.markers.size(), 2U);
  const auto& [accepted, rejected] = std::tie(array.markers[0], array.markers[1]);
  EXPECT_EQ(accepted.ns, "accepted");
  EXPECT_EQ(rejected.ns, "rejected");
  ASSERT_EQ(accepted.points.size(), 2U);
  ASSERT_EQ(rejected.points.size(), 2U);
  const Eigen::Vector3d end = contents.keyframes.back().map_from_vehicle.translation();
  EXPECT_NEAR(accepted.points[1].x, end.x(), 1e-12);
  EXPECT_NEAR(accepted.points[1].y, end.y(), 1e-12);
  EXPECT_GT(accepted.color.g, accepted.color.r);
  EXPECT_GT(rejected.color.r, rejected.color.g);
  EXPECT_EQ(accepted.action, visualization_msgs::Marker::ADD);
  contents.loop_edges.clear();
  EXPECT_EQ(makeLoopEdgeMarkers(SparseMap(contents)).markers[0].action, visualization_msgs::Marker::DELETE);
}

}  // namespace
}  // namespace vcharge
