#include "vcharge_obstacles/map_scan.h"

#include <cmath>

#include <gtest/gtest.h>

#include "fusion/obstacle_map_cells.h"
#include "vcharge_obstacles/obstacle_outlines.h"

namespace vcharge {
namespace {

/// Free map of 4 m x 4 m around the origin; the vehicle is in the middle and points along x.
ObstacleMap makeMap() {
  return makeFreeMap(40);
}

void occupy(ObstacleMap* map, int column, int row, float height_m) {
  map->state.at<int8_t>(row, column) = kCellOccupied;
  map->point_m.at<cv::Vec2f>(row, column) = {0.1F * static_cast<float>(column) + 0.05F,
                                             0.1F * static_cast<float>(row) + 0.05F};
  map->point_sigma_m.at<float>(row, column) = 0.03F;
  map->height_m.at<float>(row, column) = height_m;
  map->height_sigma_m.at<float>(row, column) = 0.02F;
}

// Angle between the y axis and the middle of the cell beside it, 1.05 m away.
constexpr double kAside_rad = 0.0476;

size_t rayTo(const ObstacleScan& scan, double angle_rad) {
  return static_cast<size_t>(std::lround((angle_rad - scan.angle_min_rad) / scan.angle_increment_rad));
}

TEST(MapScanTest, RangeIsThatOfTheNearestCell) {
  ObstacleMap map = makeMap();
  occupy(&map, 20, 30, 0.5F);  // at (0.05, 1.05)
  occupy(&map, 20, 36, 1.5F);  // behind it
  const ObstacleScan scan = makeScan(map, 360);
  const size_t ray = rayTo(scan, 0.5 * M_PI - kAside_rad);
  EXPECT_NEAR(scan.range_m[ray], 1.05, 0.01);
  EXPECT_FLOAT_EQ(scan.height_m[ray], 0.5F);
  EXPECT_GT(scan.free_m[ray], 0.8F);
  EXPECT_LT(scan.free_m[ray], 1.05F);
  EXPECT_TRUE(std::isnan(scan.range_m[rayTo(scan, 0.0)]));
  EXPECT_GT(scan.free_m[rayTo(scan, 0.0)], 1.8F);
}

TEST(MapScanTest, DirectionsTurnWithTheVehicle) {
  ObstacleMap map = makeMap();
  occupy(&map, 20, 30, 0.5F);
  map.fixed_from_vehicle = RigidTransform::planar(0.0, 0.0, 0.5 * M_PI);
  const ObstacleScan scan = makeScan(map, 360);
  EXPECT_NEAR(scan.range_m[rayTo(scan, -kAside_rad)], 1.05, 0.01);
  EXPECT_TRUE(std::isnan(scan.range_m[rayTo(scan, 0.5 * M_PI)]));
}

TEST(MapScanTest, SigmaIncludesTheCellSizeAndTheSpreadOfTheCells) {
  ObstacleMap one = makeMap();
  occupy(&one, 20, 30, 0.5F);
  const size_t ray = rayTo(makeScan(one, 360), 0.5 * M_PI - kAside_rad);
  const double cell_sigma_m = 0.1 / std::sqrt(12.0);
  EXPECT_NEAR(makeScan(one, 360).range_sigma_m[ray], std::hypot(0.03, cell_sigma_m), 1e-4);
  ObstacleMap two = one;
  occupy(&two, 20, 31, 0.5F);  // 0.1 m behind: both are 0.05 m from their mean
  EXPECT_NEAR(makeScan(two, 360).range_sigma_m[ray], std::hypot(std::hypot(0.03, cell_sigma_m), 0.05), 2e-3);
}

TEST(MapScanTest, TopOfAKerbDoesNotPullItsEdgeBack) {
  for (const float height_m : {0.12F, 0.5F}) {
    ObstacleMap map = makeMap();
    occupy(&map, 20, 30, height_m);
    occupy(&map, 20, 31, height_m);
    const ObstacleScan scan = makeScan(map, 360);
    const size_t ray = rayTo(scan, 0.5 * M_PI - kAside_rad);
    // Two cells of an upright surface are averaged; the second cell of a kerb is its top.
    EXPECT_NEAR(scan.range_m[ray], height_m < 0.2F ? 1.05 : 1.10, 0.01);
  }
}

TEST(MapScanTest, SurfaceIsNearestWhereItEntersASector) {
  ObstacleMap map = makeMap();
  constexpr float kAside_m = 0.33F;
  for (int column = 24; column < 40; ++column) {  // a wall beside the vehicle, from 0.4 m ahead on
    occupy(&map, column, 23, 0.5F);
    map.point_m.at<cv::Vec2f>(23, column)[1] = 2.0F + kAside_m;
  }
  const ObstacleScan scan = makeScan(map, 360);
  for (int degrees = 14; degrees < 32; ++degrees) {
    const size_t ray = rayTo(scan, degrees * M_PI / 180.0);
    const double entry_rad = scan.angle_rad(ray) + 0.5 * scan.angle_increment_rad;
    EXPECT_NEAR(scan.range_m[ray], kAside_m / std::sin(entry_rad), 0.005) << degrees;
  }
}

TEST(MapScanTest, FreeRangeEndsAtUnobservedGround) {
  ObstacleMap map = makeMap();
  map.state.colRange(30, 40).setTo(kCellUnobserved);
  const ObstacleScan scan = makeScan(map, 360);
  EXPECT_LT(scan.free_m[rayTo(scan, 0.0)], 1.01F);
  EXPECT_TRUE(std::isnan(scan.range_m[rayTo(scan, 0.0)]));
}

TEST(OutlinesTest, EachGroupOfCellsHasOneOutline) {
  ObstacleMap map = makeMap();
  for (int column = 10; column < 15; ++column) {
    occupy(&map, column, 10, 0.3F);
  }
  occupy(&map, 15, 11, 0.9F);  // touches at a corner
  occupy(&map, 30, 30, 0.2F);
  const std::vector<ObstacleOutline> outlines = findOutlines(map);
  ASSERT_EQ(outlines.size(), 2U);
  for (const ObstacleOutline& outline : outlines) {
    const bool is_single = outline.corners_m[0].x() > 0.5;
    EXPECT_FLOAT_EQ(static_cast<float>(outline.height_m), is_single ? 0.2F : 0.9F);
    Eigen::Vector2d low(9, 9), high(-9, -9);
    for (const Eigen::Vector2d& corner : outline.corners_m) {
      low = low.cwiseMin(corner);
      high = high.cwiseMax(corner);
    }
    EXPECT_NEAR(low.x(), is_single ? 1.0 : -1.0, 0.01);
    EXPECT_NEAR(high.x(), is_single ? 1.1 : -0.4, 0.01);
    EXPECT_NEAR(low.y(), is_single ? 1.0 : -1.0, 0.01);
    EXPECT_NEAR(high.y(), is_single ? 1.1 : -0.8, 0.01);
  }
}

TEST(OutlinesTest, MapWithoutObstaclesHasNoOutline) {
  EXPECT_TRUE(findOutlines(makeMap()).empty());
}

}  // namespace
}  // namespace vcharge
