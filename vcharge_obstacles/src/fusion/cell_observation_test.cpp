#include "fusion/cell_observation.h"

#include <gtest/gtest.h>

namespace vcharge {
namespace {

/// A camera 0.9 m above the ground that reports bare ground everywhere, with obstacles that the test adds.
class CellObserverTest : public ::testing::Test {
 protected:
  CellObserverTest() {
    seen_.camera_height_m = 0.9;
    seen_.free_fraction.assign(grid_.size(), 1.0F);
    seen_.hidden_fraction.assign(grid_.size(), 0.0F);
    seen_.unknown_fraction.assign(grid_.size(), 0.0F);
  }
  void addObstacle(int ray, double range_m, double height_m = 1.0) {
    PolarObstacle obstacle;
    obstacle.ray = grid_.wrap(ray);
    obstacle.range_m = range_m;
    obstacle.range_sigma_m = 0.02;
    obstacle.height_m = height_m;
    seen_.obstacles.push_back(obstacle);
  }
  bool isBlocked(int ray, double range_m) const {
    const int bin = grid_.binOfInverse(static_cast<float>(1.0 / range_m));
    return CellObserver(seen_, grid_, kCell_m)
        .observe(grid_.angle_rad(grid_.wrap(ray)), range_m, bin)
        .blocked;
  }

  static constexpr double kCell_m = 0.01;  // so small that one ray crosses it
  const PolarGrid grid_;
  CameraObstacles seen_;
};

TEST_F(CellObserverTest, GroundUnderADarkBodyBetweenItsPartsIsBlocked) {
  // Two edges of a body are 10 degrees apart: 0.19 m at 1.1 m. Below its underside at 0.25 m, a camera at 0.9
  // m sees the ground from 1.1 m up to 1.1 / (1 - 0.25 / 0.9) = 1.52 m.
  for (const int first : {100, 355}) {  // also across the first sector
    seen_.obstacles.clear();
    addObstacle(first, 1.1);
    addObstacle(first + 10, 1.15);
    EXPECT_FALSE(isBlocked(first + 5, 1.0)) << first;
    EXPECT_TRUE(isBlocked(first + 1, 1.2)) << first;
    EXPECT_TRUE(isBlocked(first + 5, 1.2)) << first;
    EXPECT_TRUE(isBlocked(first + 9, 1.45)) << first;
    EXPECT_FALSE(isBlocked(first + 5, 1.6)) << first;
    EXPECT_FALSE(isBlocked(first + 15, 1.2)) << first;
    EXPECT_FALSE(isBlocked(first - 5, 1.2)) << first;
  }
}

TEST_F(CellObserverTest, LowObstaclesAreNoBody) {
  addObstacle(100, 1.1, 0.12);
  addObstacle(110, 1.1, 0.12);
  addObstacle(200, 1.1, 1.0);
  addObstacle(210, 1.1, 0.12);
  EXPECT_FALSE(isBlocked(105, 1.2));
  EXPECT_FALSE(isBlocked(205, 1.2));
}

TEST_F(CellObserverTest, SeparateObstaclesAreNoBody) {
  addObstacle(100, 1.1);
  addObstacle(120, 1.1);  // 0.38 m beside it
  EXPECT_FALSE(isBlocked(110, 1.2));
  addObstacle(200, 1.1);
  addObstacle(210, 1.6);  // 0.5 m further
  EXPECT_FALSE(isBlocked(205, 1.2));
  EXPECT_FALSE(isBlocked(205, 1.7));
}

TEST_F(CellObserverTest, FarObstacleBehindAGapDoesNotOpenIt) {
  addObstacle(100, 1.1);
  addObstacle(105, 3.3);
  addObstacle(110, 1.1);
  EXPECT_TRUE(isBlocked(105, 1.3));
}

}  // namespace
}  // namespace vcharge
