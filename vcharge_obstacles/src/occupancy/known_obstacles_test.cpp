#include "occupancy/known_obstacles.h"

#include <limits>
#include <vector>

#include <gtest/gtest.h>

namespace vcharge {
namespace {

/// A map of 10 x 10 m around (5, 0) with a wall along y from -1 m to 1 m at x = 4 m.
ObstacleMap mapOfWall() {
  ObstacleMap map = ObstacleMap::unobserved({100, 100}, 0.1);
  map.origin_m = {0.0, -5.0};
  for (int row = 40; row < 60; ++row) {
    map.state.at<int8_t>(row, 40) = kCellOccupied;
  }
  return map;
}

TEST(KnownObstaclesTest, WhatIsBehindAWallIsHidden) {
  KnownObstacles obstacles;
  const Eigen::Vector2d camera_m(0.0, 0.0), ahead(1.0, 0.0);
  EXPECT_FALSE(obstacles.hideLine(camera_m, ahead, 6.0)) << "without a map, nothing is hidden";
  obstacles.set(mapOfWall());
  EXPECT_TRUE(obstacles.hideLine(camera_m, ahead, 6.0));
  EXPECT_FALSE(obstacles.hideLine(camera_m, ahead, 3.5)) << "in front of the wall";
  EXPECT_FALSE(obstacles.hideLine(camera_m, Eigen::Vector2d(4.0, 2.0).normalized(), 6.0))
      << "beside the wall";
  EXPECT_FALSE(obstacles.hideLine(camera_m, -ahead, 6.0)) << "outside of the map";
  obstacles = KnownObstacles();
  EXPECT_FALSE(obstacles.hideLine(camera_m, ahead, 6.0));
}

TEST(KnownObstaclesTest, TheCameraIsNotHiddenByItsOwnVehicle) {
  KnownObstacles obstacles;
  obstacles.set(mapOfWall());
  EXPECT_FALSE(obstacles.hideLine({4.0, 0.0}, {1.0, 0.0}, 4.0));
}

TEST(KnownObstaclesTest, ObjectsAreLeftOutIfNoCameraSeesThem) {
  KnownObstacles obstacles;
  obstacles.set(mapOfWall());
  // Axes of cameras, their z axes, that point along x.
  const Eigen::Quaterniond along_x =
      Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), Eigen::Vector3d::UnitX());
  const RigidTransform before(along_x, {0.0, 0.0, 1.0}), beside(along_x, {3.0, 3.0, 1.0}),
      ahead(along_x, {8.0, 0.0, 1.0});
  TrackedObject person;
  person.frame_from_object = RigidTransform::planar(6.0, 0.0, 0.0);
  person.footprint_m = {{5.8, -0.2}, {6.2, -0.2}, {6.0, 0.3}};
  const auto numLeft = [&](const std::vector<RigidTransform>& cameras) {
    std::vector<TrackedObject> objects = {person};
    obstacles.removeHidden(cameras, &objects);
    return objects.size();
  };
  EXPECT_EQ(numLeft({before}), 0U);
  EXPECT_EQ(numLeft({before, beside}), 1U) << "the second camera sees past the wall";
  EXPECT_EQ(numLeft({before, ahead}), 0U) << "the second camera points away from the person";
  EXPECT_EQ(numLeft({}), 1U);
}

TEST(KnownObstaclesTest, DegenerateLinesHideNothing) {
  KnownObstacles obstacles;
  obstacles.set(mapOfWall());
  EXPECT_FALSE(obstacles.hideLine({0.0, 0.0}, {1.0, 0.0}, -1.0));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(obstacles.hideLine({0.0, 0.0}, {1.0, 0.0}, nan));
}

}  // namespace
}  // namespace vcharge
