#include "vcharge_core/motion/fading_path.h"

#include <cmath>

#include <gtest/gtest.h>

namespace vcharge {
namespace {

RigidTransform poseAt(double x_m, double yaw_rad = 0.0) {
  return RigidTransform::planar(x_m, 0.0, yaw_rad);
}

TEST(FadingPathTest, ImagesAtRestReplaceOneAnotherUntilTheFirstMotion) {
  FadingPath path(5.0);
  EXPECT_EQ(path.moveTo(poseAt(2.0)), 1.0);
  EXPECT_EQ(path.moveTo(poseAt(2.0)), 1.0);
  EXPECT_EQ(path.length_m(), 0.0);
  EXPECT_EQ(path.moveTo(poseAt(2.5)), 1.0);
  EXPECT_EQ(path.moveTo(poseAt(2.5)), 0.0);
  EXPECT_EQ(path.length_m(), 0.5);
}

TEST(FadingPathTest, ShareIsThePathOfTheImageOverThatOfAllWhichFades) {
  FadingPath path(4.0);
  path.moveTo(poseAt(0.0));
  path.moveTo(poseAt(1.0));
  EXPECT_NEAR(path.moveTo(poseAt(1.5)), 0.5 / (0.5 + std::exp(-0.5 / 4.0)), 1e-12);
  for (int i = 0; i < 1000; ++i) {
    path.moveTo(poseAt(1.5 + 0.1 * i));
  }
  EXPECT_NEAR(path.length_m(), 0.1 / (1.0 - std::exp(-0.1 / 4.0)), 1e-6);
}

TEST(FadingPathTest, TurnsFadeToo) {
  FadingPath path(4.0, 0.1);
  path.moveTo(poseAt(0.0));
  path.moveTo(poseAt(1.0));
  path.moveTo(poseAt(1.0, 0.2));
  EXPECT_NEAR(path.length_m(), std::exp(-2.0), 1e-12);
}

TEST(FadingPathTest, ImagesThatDoNotCountFadeTheOthers) {
  FadingPath path(4.0);
  path.moveTo(poseAt(0.0));
  path.moveTo(poseAt(1.0));
  EXPECT_EQ(path.moveTo(poseAt(2.0), false), 0.0);
  EXPECT_NEAR(path.length_m(), std::exp(-0.25), 1e-12);
}

TEST(FadingPathTest, OneImageAfterAGapDoesNotOutweighAllOthers) {
  FadingPath path(5.0);
  path.moveTo(poseAt(0.0));
  path.moveTo(poseAt(100.0));
  EXPECT_EQ(path.length_m(), 1.0);
}

TEST(FadingPathTest, ClearForgetsPathAndPose) {
  FadingPath path(5.0);
  path.moveTo(poseAt(0.0));
  path.moveTo(poseAt(1.0));
  path.clear();
  EXPECT_EQ(path.length_m(), 0.0);
  EXPECT_EQ(path.moveTo(poseAt(7.0)), 1.0);
  EXPECT_EQ(path.length_m(), 0.0);
}

}  // namespace
}  // namespace vcharge
