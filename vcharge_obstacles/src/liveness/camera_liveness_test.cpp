#include "liveness/camera_liveness.h"

#include <gtest/gtest.h>

#include "vcharge_obstacles/image_fingerprint.h"

namespace vcharge {
namespace {

using State = CameraLiveness::State;

Timestamp at(double time_s) {
  return Timestamp() + durationFromSeconds(100.0 + time_s);
}

/// A vehicle that drives at 1 m/s between start_s_ and stop_s_.
class CameraLivenessTest : public ::testing::Test {
 protected:
  void settle(double until_s) {
    liveness_.settle(at(until_s), [this](Timestamp stamp) -> std::optional<RigidTransform> {
      const double time_s = toSeconds(stamp - at(0.0));
      return RigidTransform::planar(std::min(std::max(time_s, start_s_), stop_s_), 0.0, 0.0);
    });
  }
  /// Images every 0.1 s, all different unless a fingerprint is given.
  void addImages(double from_s, double to_s, std::optional<uint64_t> fingerprint = std::nullopt) {
    for (int i = 0; from_s + 0.1 * i < to_s - 1e-6; ++i) {
      liveness_.addImage(at(from_s + 0.1 * i), fingerprint.value_or(next_++));
    }
  }
  bool wasSilent(double from_s, double to_s) const { return liveness_.wasSilent(at(from_s), at(to_s)); }

  CameraLiveness liveness_;
  double start_s_ = 0.0, stop_s_ = 1e6;
  uint64_t next_ = 1000;
};

TEST_F(CameraLivenessTest, NothingIsKnownBeforeTheFirstImage) {
  liveness_.addRangeMap(at(0.0));
  EXPECT_EQ(liveness_.stateAt(at(5.0)), State::kUnknown);
  EXPECT_FALSE(wasSilent(0.0, 5.0));
  EXPECT_TRUE(liveness_.isAlive(at(0.0), at(0.1)));  // by its range map
  EXPECT_FALSE(liveness_.isAlive(at(0.0), at(0.5)));
}

TEST_F(CameraLivenessTest, SilenceBeginsAfterThreeTenthsOfASecond) {
  addImages(0.0, 1.05);
  settle(1.0);
  EXPECT_EQ(liveness_.stateAt(at(1.299)), State::kAlive);
  EXPECT_EQ(liveness_.stateAt(at(1.3)), State::kSilent);
  EXPECT_EQ(*liveness_.lastNew(), at(1.0));
  EXPECT_FALSE(wasSilent(0.0, 1.2));
  EXPECT_TRUE(wasSilent(0.0, 1.4));
  EXPECT_FALSE(liveness_.isAlive(at(1.0), at(1.4)));
}

TEST_F(CameraLivenessTest, GapIsRememberedAfterTheCameraHasRecovered) {
  addImages(0.0, 1.05);
  addImages(2.0, 3.05);
  settle(3.0);
  EXPECT_EQ(liveness_.stateAt(at(3.0)), State::kAlive);
  EXPECT_EQ(liveness_.stateAt(at(1.5)), State::kSilent);
  EXPECT_TRUE(wasSilent(0.5, 3.0));
  EXPECT_TRUE(wasSilent(1.9, 3.0));
  EXPECT_FALSE(wasSilent(2.0, 3.0));  // after the gap
  EXPECT_FALSE(wasSilent(0.5, 1.29));
  EXPECT_TRUE(wasSilent(0.5, 1.3));
}

TEST_F(CameraLivenessTest, RangeMapsFillAGapOfTheImages) {
  addImages(0.0, 1.05);
  addImages(1.5, 2.05);
  settle(2.0);
  ASSERT_TRUE(wasSilent(1.0, 2.0));
  liveness_.addRangeMap(at(1.25));  // late, but of an image in the gap
  EXPECT_FALSE(wasSilent(1.0, 2.0));
  liveness_.addRangeMap(at(2.2));
  EXPECT_FALSE(wasSilent(2.0, 2.4));
  EXPECT_TRUE(wasSilent(2.0, 2.5));
}

TEST_F(CameraLivenessTest, RepeatedImagesOfAMovingVehicleAreFrozen) {
  addImages(0.0, 1.05);
  addImages(1.1, 2.05, 7);  // the first one is new
  settle(2.0);
  EXPECT_FALSE(liveness_.isRepeated(at(1.1)));
  EXPECT_TRUE(liveness_.isRepeated(at(1.2)));
  EXPECT_EQ(liveness_.stateAt(at(1.35)), State::kAlive);
  EXPECT_EQ(liveness_.stateAt(at(1.4)), State::kFrozen);
  EXPECT_EQ(liveness_.stateAt(at(2.0)), State::kFrozen);
  EXPECT_EQ(*liveness_.lastNew(), at(1.1));
  liveness_.addRangeMap(at(1.9));  // of a repeated image: proves nothing
  EXPECT_EQ(liveness_.stateAt(at(2.0)), State::kFrozen);
  EXPECT_EQ(liveness_.stateAt(at(2.5)), State::kSilent);  // now the images have stopped, too
  addImages(2.6, 2.65);
  settle(3.0);
  EXPECT_EQ(liveness_.stateAt(at(2.65)), State::kAlive);
  EXPECT_FALSE(liveness_.isRepeated(at(2.6)));
}

TEST_F(CameraLivenessTest, RepeatedImagesOfAStandingVehicleAreNot) {
  stop_s_ = 1.0;
  addImages(0.0, 1.05);
  addImages(1.1, 5.05, 7);
  settle(5.0);
  EXPECT_EQ(liveness_.stateAt(at(5.0)), State::kAlive);
  EXPECT_FALSE(liveness_.isRepeated(at(4.0)));
}

TEST_F(CameraLivenessTest, ImagesThatStopWhileTheVehicleStandsAreSilence) {
  stop_s_ = 1.0;
  addImages(0.0, 3.05);
  settle(5.0);
  EXPECT_EQ(liveness_.stateAt(at(3.2)), State::kAlive);
  EXPECT_EQ(liveness_.stateAt(at(3.31)), State::kSilent);
}

TEST_F(CameraLivenessTest, ImagesAreJudgedWhenTheOdometryReachesThem) {
  addImages(0.0, 1.05);
  settle(0.55);
  EXPECT_EQ(*liveness_.lastNew(), at(0.5));
  settle(1.0);
  EXPECT_EQ(*liveness_.lastNew(), at(1.0));
}

TEST_F(CameraLivenessTest, OldAndRepeatedStampsAreIgnored) {
  addImages(0.0, 1.05);
  settle(1.0);
  liveness_.addImage(at(0.5), 7);
  liveness_.addImage(at(1.0), 7);
  settle(2.0);
  EXPECT_EQ(*liveness_.lastNew(), at(1.0));
}

TEST_F(CameraLivenessTest, JumpOfThePosesFreezesNothing) {
  stop_s_ = 1.0;
  addImages(0.0, 1.05);
  addImages(1.1, 2.05, 7);
  settle(2.0);
  liveness_.noteJump();
  stop_s_ = start_s_ = 50.0;  // the odometer has another origin
  addImages(2.1, 3.05, 7);
  settle(3.0);
  EXPECT_EQ(liveness_.stateAt(at(3.0)), State::kAlive);
}

TEST(ImageFingerprintTest, DiffersWhereSampledBytesDo) {
  cv::Mat image(800, 1280, CV_8UC1, cv::Scalar(100));
  const uint64_t same = fingerprintOf(image);
  EXPECT_EQ(fingerprintOf(image.clone()), same);
  image.at<uint8_t>(0, 0) = 101;
  EXPECT_NE(fingerprintOf(image), same);
  std::vector<uint8_t> bytes(100000, 3);
  const uint64_t compressed = fingerprintOf(bytes.data(), bytes.size());
  EXPECT_NE(fingerprintOf(bytes.data(), bytes.size() - 1), compressed);
  bytes[0] = 4;
  EXPECT_NE(fingerprintOf(bytes.data(), bytes.size()), compressed);
  EXPECT_NO_THROW(fingerprintOf(cv::Mat()));
  EXPECT_NO_THROW(fingerprintOf(nullptr, 0));
}

}  // namespace
}  // namespace vcharge
