#include <cmath>

#include <gtest/gtest.h>

#include "fusion/obstacle_mapper_fixture.h"

namespace vcharge {
namespace {

// A kerb of 10 cm along y = 2.
const BoxWorld kKerb{{{{-20.0, 2.0, -0.1}, {40.0, 4.0, 0.1}}}};

/// Number of steps within 10 cm of the line y = y_m, or anywhere else.
int countSteps(const StepMap& map, double y_m, bool is_near) {
  int count = 0;
  for (int row = 0; row < map.height_m.rows; ++row) {
    const double distance_m = std::abs(map.origin_m.y() + map.cell_size_m * (row + 0.5) - y_m);
    for (int column = 0; column < map.height_m.cols; ++column) {
      count += map.height_m.at<float>(row, column) > 0.0F && (distance_m <= 0.1) == is_near ? 1 : 0;
    }
  }
  return count;
}

TEST_F(ObstacleMapperTest, AKerbIsAStepOfTheFrame) {
  world_ = kKerb;
  start();
  drive(0, 81);
  mapper_->finish();
  const StepMap& steps = frames_.back().steps;
  EXPECT_EQ(steps.frame_id, "odom");
  EXPECT_EQ(steps.stamp, frames_.back().map.stamp);
  EXPECT_GT(countSteps(steps, 2.0, true), 100);
  EXPECT_LT(countSteps(steps, 2.0, false), 10);
}

TEST_F(ObstacleMapperTest, ADarkCameraLeavesItsSideOfTheStepsUnknown) {
  world_ = kKerb;
  rig_ = makeSideRig();
  blind_camera_ = "left";
  start();
  drive(0, 81);
  mapper_->finish();
  EXPECT_EQ(countSteps(frames_.back().steps, 2.0, true), 0);
  EXPECT_GT(cv::countNonZero(frames_.back().steps.height_m == 0.0F), 1000);  // on the right
}

TEST_F(ObstacleMapperTest, StepsOutlastStandingAndNoJumpOfTheOdometry) {
  world_ = kKerb;
  stops_at_ = 80;
  start();
  drive(0, 400);
  EXPECT_GT(countSteps(frames_.back().steps, 2.0, true), 100);
  jumps_at_ = 400;
  jump_m_ = 5.0;
  drive(400, 404);
  EXPECT_EQ(countSteps(frames_.back().steps, 2.0, true), 0);
}

}  // namespace
}  // namespace vcharge
