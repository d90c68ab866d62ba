#include "vcharge_ros/obstacle_conversions.h"

#include <cmath>
#include <functional>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "vcharge_core/base/error.h"

namespace vcharge {
namespace {

TEST(OccupancyGridTest, HoldsStepsEvenAndUnknownGround) {
  StepMap map = StepMap::unknown({4, 3}, 0.05);
  map.stamp = Timestamp::fromNanoseconds(5000000000);
  map.frame_id = "odom";
  map.origin_m = {-0.2, 5.0};
  map.height_m.at<float>(0, 1) = 0.0F;
  map.height_m.at<float>(2, 3) = 0.08F;
  const nav_msgs::OccupancyGrid grid = toMessage(map);
  EXPECT_EQ(grid.header.frame_id, "odom");
  EXPECT_EQ(grid.header.stamp.sec, 5U);
  EXPECT_EQ(grid.info.width, 4U);
  EXPECT_EQ(grid.info.height, 3U);
  EXPECT_NEAR(grid.info.resolution, 0.05, 1e-6);
  EXPECT_NEAR(grid.info.origin.position.y, 5.0, 1e-12);
  ASSERT_EQ(grid.data.size(), 12U);
  for (size_t i = 0; i < grid.data.size(); ++i) {
    EXPECT_EQ(grid.data[i], i == 1 ? 0 : i == 11 ? 100 : -1) << i;
  }
}

TEST(OccupancyGridTest, CellsReturnFromTheirMessage) {
  ObstacleMap map = ObstacleMap::unobserved({4, 3}, 0.1);
  map.stamp = Timestamp::fromNanoseconds(5000000000LL);
  map.frame_id = "odom";
  map.origin_m = {-2.0, 7.5};
  map.state.at<int8_t>(2, 1) = kCellOccupied;
  map.state.at<int8_t>(0, 3) = kCellFree;
  const ObstacleMap back = fromMessage(toMessage(map), "/obstacles/grid");
  EXPECT_EQ(cv::countNonZero(back.state != map.state), 0);
  EXPECT_EQ(back.stamp, map.stamp);
  EXPECT_EQ(back.frame_id, "odom");
  EXPECT_EQ(back.origin_m, map.origin_m);
  EXPECT_NEAR(back.cell_size_m, 0.1, 1e-6);
}

TEST(OccupancyGridTest, BadGridsAreRefusedWithTheirTopic) {
  ObstacleMap map = ObstacleMap::unobserved({4, 3}, 0.1);
  map.stamp = Timestamp::fromNanoseconds(5000000000LL);
  map.frame_id = "odom";
  using Spoil = std::function<void(nav_msgs::OccupancyGrid*)>;
  const std::vector<Spoil> spoils = {[](auto* grid) { grid->data.pop_back(); },
                                     [](auto* grid) { grid->info.resolution = 0.0F; },
                                     [](auto* grid) { grid->info.resolution = NAN; },
                                     [](auto* grid) { grid->info.origin.orientation.z = 0.5; },
                                     [](auto* grid) { grid->header.frame_id.clear(); },
                                     [](auto* grid) { grid->header.stamp = ros::Time(); },
                                     [](auto* grid) { grid->info.width = 4000000000U; }};
  for (const Spoil& spoil : spoils) {
    nav_msgs::OccupancyGrid grid = toMessage(map);
    spoil(&grid);
    try {
      fromMessage(grid, "/obstacles/grid");
      ADD_FAILURE() << "expected an error";
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), ::testing::HasSubstr("/obstacles/grid: expected"));
    }
  }
}

}  // namespace
}  // namespace vcharge
