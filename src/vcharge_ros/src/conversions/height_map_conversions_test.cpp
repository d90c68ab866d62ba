#include "vcharge_ros/height_map_conversions.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "vcharge_core/base/error.h"

namespace vcharge {
namespace {

HeightMap makeMap() {
  HeightMap map;
  map.frame_id = "map";
  map.origin_m = {1.0, -2.0};
  map.cell_size_m = 0.1;
  map.height_m = (cv::Mat_<float>(2, 3) << 0.1F, 0.2F, 0.3F, 0.4F, 0.5F, std::nanf(""));
  map.confidence = (cv::Mat_<float>(2, 3) << 0.9F, 0.8F, 0.7F, 0.6F, 0.5F, 0.0F);
  map.gray = (cv::Mat_<uint8_t>(2, 3) << 10, 20, 30, 40, 51, 0);
  map.solid = (cv::Mat_<uint8_t>(2, 3) << 0, 0, 0, 0, 0, 1);
  return map;
}

std::string hashOf(HeightMap map) {
  map.gray = cv::Mat();
  ContentHasher hasher;
  addToHash(map, &hasher);
  return hasher.hex();
}

const Timestamp kStamp = Timestamp::fromNanoseconds(7);

TEST(HeightMapConversionsTest, MessageKeepsEveryCell) {
  HeightMap map = makeMap();
  EXPECT_EQ(hashOf(fromMessage(toMessage(map, kStamp), "/topic")), hashOf(map));
  map.solid = cv::Mat();
  EXPECT_EQ(hashOf(fromMessage(toMessage(map, kStamp), "/topic")), hashOf(map));
}

TEST(HeightMapConversionsTest, RefuseMessagesThatDoNotFit) {
  vcharge_msgs::HeightMap message = toMessage(makeMap(), kStamp);
  message.height_m.pop_back();
  EXPECT_THROW(fromMessage(message, "/topic"), InputError);
  message = toMessage(makeMap(), kStamp);
  message.cell_size_m = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(fromMessage(message, "/topic"), InputError);
  message = toMessage(makeMap(), kStamp);
  message.solid.pop_back();
  EXPECT_THROW(fromMessage(message, "/topic"), InputError);
  message = toMessage(makeMap(), kStamp);
  message.columns = 0;
  EXPECT_THROW(fromMessage(message, "/topic"), InputError);
}

TEST(HeightMapConversionsTest, CloudHasTheObservedCells) {
  const sensor_msgs::PointCloud2 cloud = makeHeightCloud(makeMap(), kStamp);
  ASSERT_EQ(cloud.width, 5U);
  const auto* last = reinterpret_cast<const float*>(cloud.data.data()) + 4 * 5;
  EXPECT_FLOAT_EQ(last[0], 1.1F);
  EXPECT_FLOAT_EQ(last[1], -1.9F);
  EXPECT_FLOAT_EQ(last[2], 0.5F);
  EXPECT_FLOAT_EQ(last[3], 51.0F);
  EXPECT_FLOAT_EQ(last[4], 0.5F);
}

TEST(HeightMapConversionsTest, GridHasItsCornerAndThreeStates) {
  const cv::Mat states = (cv::Mat_<uint8_t>(2, 3) << 0, 1, 2, 0, 0, 2);
  const nav_msgs::OccupancyGrid grid = makeOccupancyGrid(makeMap(), states, kStamp);
  EXPECT_EQ(grid.data, (std::vector<int8_t>{0, 100, -1, 0, 0, -1}));
  EXPECT_DOUBLE_EQ(grid.info.origin.position.x, 0.95);
  EXPECT_DOUBLE_EQ(grid.info.origin.position.y, -2.05);
  EXPECT_EQ(grid.info.width, 3U);
}

TEST(HeightMapConversionsTest, MeshLeavesHolesAndKeepsToItsLimit) {
  const visualization_msgs::Marker mesh = makeHeightMesh(makeMap(), kStamp);
  ASSERT_EQ(mesh.points.size(), 6U);  // one of the two squares has an unobserved corner
  EXPECT_FLOAT_EQ(static_cast<float>(mesh.points[2].z), 0.5F);
  EXPECT_FLOAT_EQ(mesh.colors[2].r, 0.2F);
  HeightMap large = makeMap();
  large.height_m = cv::Mat(200, 300, CV_32FC1, cv::Scalar(1.0));
  large.gray = large.confidence = cv::Mat();
  const size_t triangles = makeHeightMesh(large, kStamp, 5000).points.size() / 3;
  EXPECT_LE(triangles, 5000U);
  EXPECT_GT(triangles, 2000U);
  large.height_m.setTo(std::nanf(""));
  EXPECT_EQ(makeHeightMesh(large, kStamp).action, visualization_msgs::Marker::DELETE);
}

}  // namespace
}  // namespace vcharge
