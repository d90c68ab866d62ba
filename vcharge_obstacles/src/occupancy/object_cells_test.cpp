#include "occupancy/object_cells.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "fusion/obstacle_map_cells.h"

namespace vcharge {
namespace {

TrackedObject objectWith(const std::vector<Eigen::Vector2d>& footprint_m) {
  TrackedObject object;
  object.footprint_m = footprint_m;
  return object;
}

TEST(ObjectCellsTest, OnlyFreeCellsUnderAndBesideAnObjectAreForgotten) {
  ObstacleMap map = makeFreeMap(100);
  map.state.at<int8_t>(55, 75) = kCellOccupied;  // at (2.55, 0.55)
  forgetFreeUnder({objectWith({{2.0, 0.0}, {3.0, 0.0}, {3.0, 1.0}, {2.0, 1.0}})}, &map);
  EXPECT_EQ(map.state.at<int8_t>(55, 75), kCellOccupied);
  EXPECT_EQ(map.state.at<int8_t>(57, 72), kCellUnobserved);
  for (int row = 0; row < 100; ++row) {
    for (int column = 0; column < 100; ++column) {
      const double x_m = -5.0 + 0.1 * (column + 0.5), y_m = -5.0 + 0.1 * (row + 0.5);
      const double dx_m = std::max({2.0 - x_m, x_m - 3.0, 0.0}), dy_m = std::max({0.0 - y_m, y_m - 1.0, 0.0});
      const double distance_m = std::hypot(dx_m, dy_m);
      if (distance_m < 0.14) {
        EXPECT_NE(map.state.at<int8_t>(row, column), kCellFree) << x_m << " " << y_m;
      } else if (distance_m > 0.31) {
        EXPECT_EQ(map.state.at<int8_t>(row, column), kCellFree) << x_m << " " << y_m;
      }
    }
  }
}

TEST(ObjectCellsTest, ObjectsOutsideOfTheMapOrWithoutAnOutlineChangeNothing) {
  ObstacleMap map = makeFreeMap(100);
  forgetFreeUnder({objectWith({{50.0, 50.0}, {51.0, 50.0}, {51.0, 51.0}}), objectWith({}),
                   objectWith({{0.0, 0.0}, {1.0, 0.0}})},
                  &map);
  EXPECT_EQ(cv::countNonZero(map.state != kCellFree), 0);
  forgetFreeUnder({}, &map);
  EXPECT_EQ(cv::countNonZero(map.state != kCellFree), 0);
}

}  // namespace
}  // namespace vcharge
