#include "fusion/cell_look.h"

#include <gtest/gtest.h>

namespace vcharge {
namespace {

/// A camera 0.9 m above bare ground, all of which it says to see, with obstacles as tests place them.
class CellLookerTest : public ::testing::Test {
 protected:
  CellLookerTest() {
    seen_.camera_height_m = 0.9;
    seen_.free_share.assign(grid_.size(), 1.0F);
    seen_.hidden_share.assign(grid_.size(), 0.0F);
    seen_.unknown_share.assign(grid_.size(), 0.0F);
  }
  void place(int ray, double range_m, double height_m = 1.0) {
    PolarObstacle obstacle;
    obstacle.ray = grid_.wrap(ray);
    obstacle.range_m = range_m;
    obstacle.range_sigma_m = 0.02;
    obstacle.height_m = height_m;
    seen_.obstacles.push_back(obstacle);
  }
  bool isBlocked(int ray, double range_m) const {
    const int bin = grid_.binOfInverse(static_cast<float>(1.0 / range_m));
    return CellLooker(seen_, grid_, kCell_m).look(grid_.angle_rad(grid_.wrap(ray)), range_m, bin).blocked;
  }

  static constexpr double kCell_m = 0.01;  // so small that one ray crosses it
  const PolarGrid grid_;
  CameraObstacles seen_;
};

TEST_F(CellLookerTest, GroundUnderADarkBodyBetweenTwoSightingsIsBlocked) {
  // Two edges of a body, 10 degrees apart: 0.19 m at 1.1 m. Under it, 0.25 m above the ground, a camera at
  // 0.9 m sees the ground from 1.1 m up to 1.1 / (1 - 0.25 / 0.9) = 1.52 m.
  for (const int first : {100, 355}) {  // also where the sectors begin anew
    seen_.obstacles.clear();
    place(first, 1.1);
    place(first + 10, 1.15);
    EXPECT_FALSE(isBlocked(first + 5, 1.0)) << first;
    EXPECT_TRUE(isBlocked(first + 1, 1.2)) << first;
    EXPECT_TRUE(isBlocked(first + 5, 1.2)) << first;
    EXPECT_TRUE(isBlocked(first + 9, 1.45)) << first;
    EXPECT_FALSE(isBlocked(first + 5, 1.6)) << first;
    EXPECT_FALSE(isBlocked(first + 15, 1.2)) << first;
    EXPECT_FALSE(isBlocked(first - 5, 1.2)) << first;
  }
}

TEST_F(CellLookerTest, LowThingsAreNoBodies) {
  place(100, 1.1, 0.12);
  place(110, 1.1, 0.12);
  place(200, 1.1, 1.0);
  place(210, 1.1, 0.12);
  EXPECT_FALSE(isBlocked(105, 1.2));
  EXPECT_FALSE(isBlocked(205, 1.2));
}

TEST_F(CellLookerTest, ThingsApartAreNoBody) {
  place(100, 1.1);
  place(120, 1.1);  // 0.38 m beside it
  EXPECT_FALSE(isBlocked(110, 1.2));
  place(200, 1.1);
  place(210, 1.6);  // 0.5 m further
  EXPECT_FALSE(isBlocked(205, 1.2));
  EXPECT_FALSE(isBlocked(205, 1.7));
}

TEST_F(CellLookerTest, FarThingsSeenThroughAGapDoNotOpenIt) {
  place(100, 1.1);
  place(105, 3.3);
  place(110, 1.1);
  EXPECT_TRUE(isBlocked(105, 1.3));
}

}  // namespace
}  // namespace vcharge
