#include "vcharge_localization/frame_assembler.h"

#include <vector>

#include <gtest/gtest.h>

namespace vcharge {
namespace {

Timestamp at(double seconds) {
  return Timestamp::fromNanoseconds(1'000'000'000'000LL + static_cast<int64_t>(seconds * 1e9 + 0.5));
}

Image picture() {
  return {cv::Mat(8, 8, CV_8UC1, cv::Scalar(1)), nullptr};
}

VehicleOdometry odometryAt(double seconds, double x_m) {
  VehicleOdometry odometry;
  odometry.stamp = at(seconds);
  odometry.odom_from_vehicle = RigidTransform::planar(x_m, 0.0, 0.0);
  return odometry;
}

class FrameAssemblerTest : public ::testing::Test {
 protected:
  void send(double seconds, const std::vector<size_t>& cameras) {
    for (const size_t camera : cameras) {
      assembler_.addImage(camera, at(seconds), picture());
    }
  }
  std::vector<LocalizationFrame> frames_;
  FrameAssembler assembler_{3, FrameAssemblerOptions(),
                            [this](LocalizationFrame frame) { frames_.push_back(std::move(frame)); }};
};

TEST_F(FrameAssemblerTest, WaitsForAllCamerasAndForOdometry) {
  assembler_.addOdometry(odometryAt(0.0, 0.0));
  send(0.01, {0, 1});
  assembler_.addOdometry(odometryAt(0.02, 0.2));
  EXPECT_TRUE(frames_.empty());
  send(0.01, {2});
  ASSERT_EQ(frames_.size(), 1u);
  EXPECT_NEAR(frames_[0].odom_from_vehicle->translation().x(), 0.1, 1e-9);
  send(0.09, {0, 1, 2});
  EXPECT_EQ(frames_.size(), 1u) << "no odometry yet";
  assembler_.addOdometry(odometryAt(0.1, 1.0));
  EXPECT_EQ(frames_.size(), 2u);
  EXPECT_EQ(assembler_.counts().incomplete_frames, 0);
}

TEST_F(FrameAssemblerTest, DoesNotWaitForACameraThatIsSilent) {
  for (int i = 0; i < 40; ++i) {
    assembler_.addOdometry(odometryAt(0.02 * i, 0.0));
  }
  for (int i = 0; i < 8; ++i) {
    send(0.05 + 0.08 * i, {0, 2});
  }
  EXPECT_TRUE(assembler_.isSilent(1));
  EXPECT_EQ(frames_.size(), 8u) << "the last is handed out at once";
  EXPECT_TRUE(frames_.back().images[1].pixels.empty());
  EXPECT_FALSE(frames_.back().images[2].pixels.empty());
  // It comes back.
  send(0.05 + 0.08 * 8, {1, 0, 2});
  ASSERT_EQ(frames_.size(), 9u);
  EXPECT_FALSE(frames_.back().images[1].pixels.empty());
  EXPECT_FALSE(assembler_.isSilent(1));
}

TEST_F(FrameAssemblerTest, AFrameThatLacksAnImageIsOvertaken) {
  for (int i = 0; i < 20; ++i) {
    assembler_.addOdometry(odometryAt(0.02 * i, 0.0));
  }
  send(0.08, {0, 1});
  EXPECT_TRUE(frames_.empty());
  send(0.16, {0, 1, 2});
  ASSERT_EQ(frames_.size(), 2u);
  EXPECT_LT(frames_[0].stamp, frames_[1].stamp);
  EXPECT_EQ(assembler_.counts().incomplete_frames, 1);
  send(0.08, {2});
  EXPECT_EQ(assembler_.counts().late_images, 1);
  EXPECT_EQ(frames_.size(), 2u);
}

TEST_F(FrameAssemblerTest, GoesWithoutOdometryThatDoesNotCome) {
  for (int i = 0; i < 10; ++i) {
    send(0.08 * i, {0, 1, 2});
  }
  EXPECT_GE(frames_.size(), 5u);
  EXPECT_FALSE(frames_.front().odom_from_vehicle.has_value());
  assembler_.finish();
  EXPECT_EQ(frames_.size(), 10u);
  EXPECT_EQ(assembler_.counts().frames_without_odometry, 10);
}

TEST_F(FrameAssemblerTest, CountersThatStartAgainAreCountedAndNeverInterpolatedOver) {
  for (int i = 0; i < 5; ++i) {
    assembler_.addOdometry(odometryAt(0.02 * i, 50.0));
  }
  assembler_.addOdometry(odometryAt(0.10, 0.0));
  assembler_.addOdometry(odometryAt(0.12, 0.0));
  send(0.09, {0, 1, 2});
  send(0.11, {0, 1, 2});
  assembler_.finish();
  ASSERT_EQ(frames_.size(), 2u);
  EXPECT_FALSE(frames_[0].odom_from_vehicle.has_value());
  EXPECT_TRUE(frames_[1].odom_from_vehicle.has_value());
  EXPECT_EQ(frames_[1].num_resets, 1);
}

TEST_F(FrameAssemblerTest, AReplayStartsOver) {
  assembler_.addOdometry(odometryAt(10.0, 0.0));
  assembler_.addOdometry(odometryAt(10.1, 0.0));
  send(10.05, {0, 1, 2});
  assembler_.addOdometry(odometryAt(1.0, 0.0));
  assembler_.addOdometry(odometryAt(1.1, 0.0));
  send(1.05, {0, 1, 2});
  ASSERT_EQ(frames_.size(), 2u);
  EXPECT_TRUE(frames_[1].odom_from_vehicle.has_value());
}

}  // namespace
}  // namespace vcharge
