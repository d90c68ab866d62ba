#include "vcharge_simulation/faults/exposure_faults.h"

#include <cmath>

#include <gtest/gtest.h>

namespace vcharge {
namespace {

constexpr size_t kFront = 0;
constexpr size_t kLeft = 1;
constexpr int kPeriod_ms = 80;
constexpr double kTarget = 85.0;

Timestamp start() {
  return Timestamp::fromNanoseconds(1'400'000'000'000'000'000);
}

Timestamp stampOf(int frame) {
  return start() + std::chrono::milliseconds(7 + kPeriod_ms * frame);
}

ExposureFaults make(const std::string& text, double exposure_gain = 1.0) {
  FaultOptions faults;
  readFields(YAML::Load(text), "faults.yaml", &faults);
  return ExposureFaults(faults, {"front", "left"}, CameraResponse(), start(), exposure_gain);
}

// A uniform image of this fraction of the light of the target gray value.
cv::Mat lightOf(double fraction) {
  return cv::Mat(20, 30, CV_32FC1, cv::Scalar(fraction * CameraResponse().lightFromGray(kTarget)));
}

// Exposure of the next image, which the control then observes.
Exposure take(ExposureFaults* exposures, size_t camera, int frame, const cv::Mat& light) {
  const Exposure exposure = exposures->next(camera, stampOf(frame), light);
  exposures->observe(camera, CameraResponse().expose(light, exposure));
  return exposure;
}

TEST(ExposureFaultsTest, IsNormalWithoutAFault) {
  ExposureFaults exposures = make("{}", 1.5);
  const Exposure exposure = take(&exposures, kLeft, 0, lightOf(0.1));
  EXPECT_EQ(exposure.factor, 1.5);
  EXPECT_EQ(exposure.gain, 1.0);
  EXPECT_TRUE(exposures.records()[kLeft].empty());
}

TEST(ExposureFaultsTest, StepsInItsInterval) {
  ExposureFaults exposures = make("exposure_step: {cameras: [all], start_s: 0.2, end_s: 0.4, gain: 4}");
  for (int frame = 0; frame < 8; ++frame) {
    const double factor = frame == 3 || frame == 4 ? 4.0 : 1.0;
    EXPECT_EQ(take(&exposures, kLeft, frame, lightOf(1.0)).factor, factor) << frame;
    EXPECT_EQ(take(&exposures, kFront, frame, lightOf(1.0)).factor, factor) << frame;
  }
}

TEST(ExposureFaultsTest, GainsDifferByCamera) {
  ExposureFaults exposures = make("camera_gains: {cameras: [left, front], gains: [1.6, 0.7]}");
  EXPECT_EQ(take(&exposures, kLeft, 0, lightOf(1.0)).gain, 1.6);
  EXPECT_EQ(take(&exposures, kFront, 0, lightOf(1.0)).gain, 0.7);
}

TEST(ExposureFaultsTest, EachCameraHasSettledAtItsFirstImageAndUsesTimeBeforeGain) {
  for (const auto& [fraction, factor, gain] :
       {std::tuple(2.0, 0.5, 1.0), std::tuple(0.1, 10.0, 1.0), std::tuple(0.02, 20.0, 2.5),
        std::tuple(1e-4, 20.0, 16.0), std::tuple(1e3, 0.05, 1.0)}) {
    ExposureFaults exposures = make("auto_exposure: {cameras: [left]}");
    EXPECT_EQ(take(&exposures, kFront, 0, lightOf(fraction)).factor, 1.0);
    const Exposure exposure = take(&exposures, kLeft, 0, lightOf(fraction));
    // A whole gray level is about 2 % of the light.
    EXPECT_NEAR(exposure.factor, factor, 0.015 * factor) << fraction;
    EXPECT_NEAR(exposure.gain, gain, 0.015 * gain) << fraction;
    ASSERT_EQ(exposures.records()[kLeft].size(), 1U);
    EXPECT_EQ(exposures.records()[kLeft][0].stamp, stampOf(0));
    EXPECT_NEAR(exposures.records()[kLeft][0].time_s, 1e-3 * exposure.factor, 1e-12);
    EXPECT_TRUE(exposures.records()[kFront].empty());
  }
}

TEST(ExposureFaultsTest, DeviationOfTheExposureFallsExponentially) {
  constexpr double kTimeConstant_s = 0.4;
  ExposureFaults exposures = make("auto_exposure: {cameras: [left], time_constant_s: 0.4}");
  take(&exposures, kLeft, 0, lightOf(1.0));
  // At frame 1 the light falls to a third.
  for (int frame = 1; frame < 30; ++frame) {
    const double elapsed_s = 1e-3 * kPeriod_ms * (frame - 1);
    const double expected = std::log(3.0) * (1.0 - std::exp(-elapsed_s / kTimeConstant_s));
    EXPECT_NEAR(std::log(take(&exposures, kLeft, frame, lightOf(1.0 / 3.0)).factor), expected, 0.03) << frame;
  }
}

TEST(ExposureFaultsTest, ControlCorrectsAnExposureStep) {
  ExposureFaults exposures = make(
      "{auto_exposure: {cameras: [left], time_constant_s: 0}, exposure_step: {cameras: [left], start_s: 0.2, "
      "gain: 2.5}}");
  for (int frame = 0; frame < 6; ++frame) {
    // The control sees the step in the image in which it happens.
    EXPECT_NEAR(take(&exposures, kLeft, frame, lightOf(1.0)).factor, frame == 3 ? 2.5 : 1.0, 0.04) << frame;
  }
}

}  // namespace
}  // namespace vcharge
