#include "vcharge_core/frames/frame_assembler.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace vcharge {
namespace {

Timestamp at(double seconds) {
  return Timestamp::fromNanoseconds(1'000'000'000'000LL + std::llround(seconds * 1e9));
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
  /// A still vehicle's odometry at 50 Hz.
  void sendOdometry(int from, int to, double x_m = 0.0) {
    for (int i = from; i < to; ++i) {
      assembler_.addOdometry(odometryAt(0.02 * i, x_m));
    }
  }
  std::vector<ImageFrame> frames_;
  FrameAssemblerOptions options_ = FrameAssemblerOptions::waiting(0.2, 0.3);
  const ImageFrameAssembler::FrameCallback keep_ = [this](ImageFrame frame) {
    frames_.push_back(std::move(frame));
  };
  ImageFrameAssembler assembler_{3, options_, keep_};
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
  EXPECT_EQ(assembler_.counters().incomplete_frames, 0);
}

TEST_F(FrameAssemblerTest, DoesNotWaitForACameraThatIsSilent) {
  sendOdometry(0, 40);
  for (int i = 0; i < 8; ++i) {
    send(0.05 + 0.08 * i, {0, 2});
  }
  EXPECT_TRUE(assembler_.isSilent(1));
  EXPECT_EQ(frames_.size(), 8u) << "the last is handed out at once";
  EXPECT_TRUE(frames_.back().images[1].pixels.empty());
  EXPECT_FALSE(frames_.back().images[2].pixels.empty());
  // The camera sends again.
  send(0.05 + 0.08 * 8, {1, 0, 2});
  ASSERT_EQ(frames_.size(), 9u);
  EXPECT_FALSE(frames_.back().images[1].pixels.empty());
  EXPECT_FALSE(assembler_.isSilent(1));
}

TEST_F(FrameAssemblerTest, HandsOutAFrameOnceItsMissingCameraSentALaterImage) {
  sendOdometry(0, 20);
  send(0.08, {0, 1});
  EXPECT_TRUE(frames_.empty());
  send(0.16, {0, 1, 2});
  ASSERT_EQ(frames_.size(), 2u);
  EXPECT_LT(frames_[0].stamp, frames_[1].stamp);
  EXPECT_EQ(assembler_.counters().incomplete_frames, 1);
  send(0.08, {2});
  EXPECT_EQ(assembler_.counters().late_images, (std::vector<int64_t>{0, 0, 1}));
  EXPECT_EQ(frames_.size(), 2u);
}

TEST_F(FrameAssemblerTest, HandsOutFramesWithoutAPoseWhereOdometryStaysAway) {
  for (int i = 0; i < 10; ++i) {
    send(0.08 * i, {0, 1, 2});
  }
  EXPECT_GE(frames_.size(), 5u);
  EXPECT_FALSE(frames_.front().odom_from_vehicle.has_value());
  assembler_.finish();
  EXPECT_EQ(frames_.size(), 10u);
  EXPECT_EQ(assembler_.counters().frames_without_odometry, 10);
}

TEST_F(FrameAssemblerTest, NeverInterpolatesOverAReset) {
  sendOdometry(0, 5, 50.0);
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

TEST_F(FrameAssemblerTest, BridgesAResetByTheSpeedBeforeIt) {
  const auto moving = [](double seconds, double x_m) {
    VehicleOdometry odometry = odometryAt(seconds, x_m);
    odometry.forward_speed_m_per_s = 5.0;
    return odometry;
  };
  for (int i = 0; i < 5; ++i) {
    assembler_.addOdometry(moving(0.02 * i, 50.0 + 0.1 * i));
  }
  assembler_.addOdometry(moving(0.10, 0.0));
  assembler_.addOdometry(moving(0.12, 0.1));
  send(0.07, {0, 1, 2});
  send(0.09, {0, 1, 2});
  send(0.11, {0, 1, 2});
  ASSERT_EQ(frames_.size(), 3u);
  EXPECT_NEAR(frames_[0].odom_from_vehicle->translation().x(), 50.35, 1e-9);
  EXPECT_NEAR(frames_[2].odom_from_vehicle->translation().x(), 0.05, 1e-9);
  for (size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(frames_[i].bridged_from_vehicle->translation().x(), 50.35 + 0.1 * static_cast<double>(i),
                1e-9);
  }
}

TEST_F(FrameAssemblerTest, TellsTheNextFrameOfCorrectedPoses) {
  assembler_.addOdometry(odometryAt(0.0, 0.0));
  assembler_.addOdometry(odometryAt(0.08, 0.8));  // extrapolated to the images' stamp
  send(0.08, {0, 1, 2});
  ASSERT_EQ(frames_.size(), 1u);
  assembler_.addOdometry(odometryAt(0.08, 0.7));
  assembler_.addOdometry(odometryAt(0.16, 1.5));
  send(0.16, {0, 1, 2});
  ASSERT_EQ(frames_.size(), 2u);
  ASSERT_EQ(frames_[1].corrections.size(), 1u);
  const CorrectedPose* corrected = correctionAt(frames_[1].corrections, at(0.08));
  ASSERT_NE(corrected, nullptr);
  EXPECT_EQ(corrected->odom_from_vehicle.translation().x(), 0.7);
  EXPECT_EQ(corrected->bridged_from_vehicle.translation().x(), 0.7);
  assembler_.addOdometry(odometryAt(0.24, 2.4));
  send(0.24, {0, 1, 2});
  EXPECT_TRUE(frames_[2].corrections.empty()) << "each correction is told once";
  EXPECT_EQ(assembler_.counters().odometry_corrections, 1);
}

TEST_F(FrameAssemblerTest, ASmallStepIsAResetOnlyWhereTheOptionsSaySo) {
  for (const double max_step_m : {FrameAssemblerOptions::kNoLimit, 0.15}) {
    options_.max_step_m = max_step_m;
    ImageFrameAssembler assembler(3, options_, keep_);
    for (const double x_m : {0.0, 0.1, 0.2, 0.6}) {
      assembler.addOdometry(odometryAt(x_m / 5.0, x_m));
      assembler.addOdometry(odometryAt(x_m / 5.0 + 0.01, x_m + 0.05));
    }
    assembler.addOdometry(odometryAt(0.14, 1.0));
    EXPECT_EQ(assembler.counters().odometry_resets, max_step_m < 1.0 ? 1 : 0);
  }
}

TEST_F(FrameAssemblerTest, HandsOutOlderFramesBeforeABreakAndDropsThemAfterIt) {
  std::vector<std::pair<DriveBreak, size_t>> breaks;  // each with the number of frames before it
  ImageFrameAssembler assembler(3, options_, keep_, [&](DriveBreak drive_break, Timestamp stamp) {
    EXPECT_EQ(stamp, at(1.0));
    breaks.emplace_back(drive_break, frames_.size());
  });
  assembler.addOdometry(odometryAt(0.0, 0.0));
  assembler.addImage(0, at(0.5), picture());
  assembler.addOdometry(odometryAt(1.0, 0.0));
  EXPECT_EQ(breaks, (std::vector<std::pair<DriveBreak, size_t>>{{DriveBreak::kOdometryGap, 1}}));
  EXPECT_EQ(frames_[0].odometry_status, OdometryBuffer::LookupStatus::kInGap);
  assembler.addImage(1, at(0.9), picture());
  EXPECT_EQ(assembler.counters().late_images[1], 1);
  assembler.addImage(1, at(1.0), picture());
  assembler.finish();
  EXPECT_TRUE(frames_.back().odom_from_vehicle.has_value());
}

TEST_F(FrameAssemblerTest, WaitsForACameraNoLongerThanTheOptionsSay) {
  sendOdometry(0, 10);
  send(0.10, {0, 1});
  sendOdometry(10, 20);
  EXPECT_TRUE(frames_.empty());
  sendOdometry(20, 21);
  EXPECT_EQ(frames_.size(), 1u);
}

TEST_F(FrameAssemblerTest, APatientStageLosesNoImageOfACameraThatComesBack) {
  options_.waitForEverything();
  ImageFrameAssembler assembler(2, options_, keep_);
  for (int i = 0; i < 200; ++i) {
    assembler.addOdometry(odometryAt(0.02 * i, 0.0));
    if (i % 4 == 0) {
      assembler.addImage(0, at(0.02 * i), picture());
      if (i < 40 || i >= 160) {
        assembler.addImage(1, at(0.02 * i), picture());
      }
    }
  }
  assembler.finish();
  EXPECT_EQ(frames_.size(), 50u);
  EXPECT_EQ(assembler.counters().missing_images, (std::vector<int64_t>{0, 30}));
  EXPECT_EQ(assembler.counters().numLateImages(), 0);
}

TEST_F(FrameAssemblerTest, CamerasThatAreNotUsedAreNotWaitedFor) {
  ImageFrameAssembler assembler(2, options_, keep_, nullptr, {false, true});
  assembler.addOdometry(odometryAt(0.0, 0.0));
  assembler.addImage(1, at(0.0), picture());
  EXPECT_EQ(frames_.size(), 1u);
  EXPECT_EQ(assembler.counters().incomplete_frames, 0);
  EXPECT_THROW(assembler.addImage(0, at(0.0), picture()), std::logic_error);
}

TEST_F(FrameAssemblerTest, WaitsForAnnouncedCamerasAlone) {
  sendOdometry(0, 20);
  assembler_.expect(at(0.08), {true, false, true});
  send(0.08, {0});
  EXPECT_TRUE(frames_.empty());
  send(0.08, {2});
  ASSERT_EQ(frames_.size(), 1u);
  EXPECT_FALSE(frames_[0].has_image[1]);
  // An announcement that comes after the images.
  send(0.16, {1});
  EXPECT_EQ(frames_.size(), 1u);
  assembler_.expect(at(0.16), {false, true, false});
  ASSERT_EQ(frames_.size(), 2u);
  EXPECT_TRUE(frames_[1].has_image[1]);
  // An announcement of a stamp that has passed is of no use, and other stamps wait for all cameras.
  assembler_.expect(at(0.08), {true, true, true});
  send(0.24, {0, 2});
  EXPECT_EQ(frames_.size(), 2u);
  send(0.24, {1});
  EXPECT_EQ(frames_.size(), 3u);
  EXPECT_THROW(assembler_.expect(at(0.32), {true, true}), std::logic_error);
}

TEST_F(FrameAssemblerTest, TakesPosesFromATrajectory) {
  assembler_.setTrajectory({{at(0.0), RigidTransform()}, {at(0.2), RigidTransform::planar(2.0, 0.0, 0.0)}});
  assembler_.addOdometry(odometryAt(0.1, 77.0));
  send(0.1, {0, 1, 2});
  send(0.3, {0, 1, 2});
  ASSERT_EQ(frames_.size(), 2u);
  EXPECT_NEAR(frames_[0].odom_from_vehicle->translation().x(), 1.0, 1e-9);
  EXPECT_NEAR(frames_[0].motion.rates.forward_speed_m_per_s, 10.0, 1e-9);
  EXPECT_FALSE(frames_[1].odom_from_vehicle.has_value());
}

TEST_F(FrameAssemblerTest, TakesRatesFromTheOdometry) {
  for (const double time_s : {0.0, 0.2}) {
    VehicleOdometry odometry = odometryAt(time_s, 0.0);
    odometry.forward_speed_m_per_s = 3.0 + time_s;
    odometry.yaw_rate_rad_per_s = -0.4;
    assembler_.addOdometry(odometry);
  }
  send(0.1, {0, 1, 2});
  ASSERT_EQ(frames_.size(), 1u);
  EXPECT_NEAR(frames_[0].motion.rates.forward_speed_m_per_s, 3.1, 1e-9);
  EXPECT_NEAR(frames_[0].motion.rates.yaw_rate_rad_per_s, -0.4, 1e-9);
}

/// Cameras that start at times of their own, each every 80 ms; returns the frames after all have started.
std::vector<ImageFrame> freeRunningFrames(const std::vector<double>& phases_s, double tolerance_s,
                                          double camera_0_ends_s = 1e9) {
  std::vector<ImageFrame> frames;
  ImageFrameAssembler assembler(3, FrameAssemblerOptions::waiting(0.2, 0.3),
                                [&](ImageFrame frame) { frames.push_back(std::move(frame)); });
  assembler.joinStamps(tolerance_s);
  std::vector<std::pair<double, size_t>> images;
  for (int i = 0; i < 20; ++i) {
    for (size_t camera = 0; camera < phases_s.size(); ++camera) {
      images.emplace_back(0.08 * i + phases_s[camera], camera);
    }
  }
  std::sort(images.begin(), images.end());
  for (const auto& [time_s, camera] : images) {
    assembler.addOdometry(odometryAt(time_s, 5.0 * time_s));
    if (camera != 0 || time_s < camera_0_ends_s) {
      assembler.addImage(camera, at(time_s), picture());
    }
  }
  assembler.finish();
  return frames;
}

TEST(JoinedStampsTest, EachPeriodIsAFrameWithTheFirstCamerasStamp) {
  for (const double second_s : {0.01, 0.035, 0.05, 0.079}) {
    const std::vector<ImageFrame> frames = freeRunningFrames({0.0, second_s, 0.03}, 0.04);
    ASSERT_GE(frames.size(), 19u) << second_s;
    for (size_t i = 1; i + 1 < 19; ++i) {
      const ImageFrame& frame = frames[i];
      EXPECT_EQ(frame.has_image, std::vector<bool>(3, true)) << second_s << " " << i;
      EXPECT_NEAR(toSeconds(frame.stamp - frames[i - 1].stamp), 0.08, 1e-6);
      const double offset_s = second_s > 0.04 ? second_s - 0.08 : second_s;
      EXPECT_NEAR(frame.motion.offsetOf(0), 0.0, 1e-6);
      EXPECT_NEAR(frame.motion.offsetOf(1), offset_s, 1e-6);
      EXPECT_NEAR(frame.motion.offsetOf(2), 0.03, 1e-6);
    }
  }
}

TEST(JoinedStampsTest, ImagesFurtherApartThanTheToleranceAreNotJoined) {
  const std::vector<ImageFrame> frames = freeRunningFrames({0.0, 0.007, 0.03}, 0.01);
  ASSERT_GE(frames.size(), 19u);
  for (size_t i = 1; i < 18; ++i) {
    EXPECT_EQ(frames[i].has_image, (std::vector<bool>{true, true, false}));
  }
}

TEST(JoinedStampsTest, GoesOnWithTheNextCameraWhereTheFirstFallsSilent) {
  const std::vector<ImageFrame> frames = freeRunningFrames({0.0, 0.01, 0.03}, 0.04, 0.5);
  ASSERT_FALSE(frames.empty());
  EXPECT_EQ(frames.back().has_image, (std::vector<bool>{false, true, true}));
  EXPECT_NEAR(frames.back().motion.offsetOf(1), 0.0, 1e-6);
  EXPECT_NEAR(frames.back().motion.offsetOf(2), 0.02, 1e-6);
  for (size_t i = 1; i < frames.size(); ++i) {
    EXPECT_LT(frames[i - 1].stamp, frames[i].stamp);
  }
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
