#include "vcharge_simulation/faults/image_faults.h"

#include <gtest/gtest.h>
#include <opencv2/core.hpp>

#include "vcharge_simulation/rendering/noise.h"

namespace vcharge {
namespace {

const cv::Size kSize(128, 80);
constexpr int kPeriod_ms = 80;
constexpr size_t kNumFrames = 100;

Timestamp start() {
  return Timestamp::fromNanoseconds(1'400'000'000'000'000'000);
}

Timestamp stampOf(size_t frame) {
  return start() + std::chrono::milliseconds(7 + kPeriod_ms * static_cast<int>(frame));
}

std::vector<ImageFaults::Camera> cameras() {
  return {{"front", 0}, {"left", 1}};
}

ImageFaults make(const FaultOptions& faults, uint64_t seed = 1) {
  return ImageFaults(faults, cameras(), start(), seed);
}

FaultOptions read(const std::string& text) {
  FaultOptions faults;
  readFields(YAML::Load(text), "faults.yaml", &faults);
  return faults;
}

// A different image for every frame.
cv::Mat imageOf(size_t frame) {
  cv::Mat image(kSize, CV_8UC1);
  for (int y = 0; y < kSize.height; ++y) {
    for (int x = 0; x < kSize.width; ++x) {
      const uint32_t hash = hashCell(x, y, static_cast<uint32_t>(frame));
      image.at<uint8_t>(y, x) = static_cast<uint8_t>(40 + hash % 100U);
    }
  }
  return image;
}

bool equal(const cv::Mat& a, const cv::Mat& b) {
  return a.size() == b.size() && cv::norm(a, b, cv::NORM_INF) == 0.0;
}

constexpr size_t kFront = 0;
constexpr size_t kLeft = 1;

TEST(ImageFaultsTest, ImagesPassUnchangedWithoutAFault) {
  ImageFaults faults = make({});
  for (size_t frame = 0; frame < 5; ++frame) {
    const cv::Mat image = imageOf(frame);
    const std::optional<DeliveredImage> delivered = faults.deliver(kLeft, frame, stampOf(frame), image);
    ASSERT_TRUE(delivered.has_value());
    EXPECT_EQ(delivered->stamp, stampOf(frame));
    EXPECT_EQ(delivered->received, stampOf(frame));
    EXPECT_TRUE(equal(delivered->pixels, image));
  }
}

TEST(ImageFaultsTest, DeadCameraDeliversNothingOrBlackInItsInterval) {
  ImageFaults none = make(read("dead_camera: {cameras: [left], start_s: 0.2, end_s: 0.4}"));
  ImageFaults black = make(read("dead_camera: {cameras: [left], start_s: 0.2, black_images: true}"));
  for (size_t frame = 0; frame < 8; ++frame) {
    const bool dead = frame >= 3 && frame <= 4;  // 0.247 and 0.327 s
    EXPECT_EQ(none.deliver(kLeft, frame, stampOf(frame), imageOf(frame)).has_value(), !dead) << frame;
    EXPECT_TRUE(none.deliver(kFront, frame, stampOf(frame), imageOf(frame)).has_value());
    const cv::Mat pixels = black.deliver(kLeft, frame, stampOf(frame), imageOf(frame))->pixels;
    EXPECT_EQ(cv::countNonZero(pixels) == 0, frame >= 3);
  }
}

TEST(ImageFaultsTest, FrozenCameraRepeatsTheImageBeforeTheFaultAndRecovers) {
  ImageFaults faults = make(read("frozen_camera: {cameras: [left], start_s: 0.2, end_s: 0.4}"));
  ImageFaults always = make(read("frozen_camera: {cameras: [left]}"));
  for (size_t frame = 0; frame < 8; ++frame) {
    const bool frozen = frame >= 3 && frame <= 4;
    const std::optional<DeliveredImage> delivered =
        faults.deliver(kLeft, frame, stampOf(frame), imageOf(frame));
    EXPECT_TRUE(equal(delivered->pixels, imageOf(frozen ? 2 : frame))) << frame;
    EXPECT_EQ(delivered->stamp, stampOf(frame));
    EXPECT_TRUE(equal(faults.deliver(kFront, frame, stampOf(frame), imageOf(frame))->pixels, imageOf(frame)));
    EXPECT_TRUE(equal(always.deliver(kLeft, frame, stampOf(frame), imageOf(frame))->pixels, imageOf(0)));
  }
}

TEST(ImageFaultsTest, DroppedImagesAreLostWithTheirProbabilityAndNoted) {
  ImageFaults faults = make(read("dropped_images: {cameras: [left], probability: 0.3}"));
  std::vector<Timestamp> lost;
  for (size_t frame = 0; frame < kNumFrames; ++frame) {
    EXPECT_TRUE(faults.deliver(kFront, frame, stampOf(frame), imageOf(0)).has_value());
    if (!faults.deliver(kLeft, frame, stampOf(frame), imageOf(0))) {
      lost.push_back(stampOf(frame));
    }
  }
  // Within three standard deviations of the binomial distribution.
  EXPECT_GT(lost.size(), 16U);
  EXPECT_LT(lost.size(), 44U);
  EXPECT_EQ(faults.hits().dropped[kLeft], lost);
  EXPECT_TRUE(faults.hits().dropped[kFront].empty());
}

TEST(ImageFaultsTest, LateImagesArriveLateWithTheRightStamp) {
  ImageFaults faults = make(read("late_images: {cameras: [left], probability: 0.3, delay_s: 0.2}"));
  std::vector<Timestamp> late;
  for (size_t frame = 0; frame < kNumFrames; ++frame) {
    const std::optional<DeliveredImage> image = faults.deliver(kLeft, frame, stampOf(frame), imageOf(0));
    EXPECT_EQ(image->stamp, stampOf(frame));
    if (image->received != image->stamp) {
      EXPECT_EQ(image->received - image->stamp, std::chrono::milliseconds(200));
      late.push_back(stampOf(frame));
    }
  }
  EXPECT_GT(late.size(), 16U);
  EXPECT_LT(late.size(), 44U);
  EXPECT_EQ(faults.hits().late[kLeft], late);
}

TEST(ImageFaultsTest, ShiftedStampsLeaveTheArrivalAsItIs) {
  ImageFaults faults = make(read("image_stamp_shift: {cameras: [left], start_s: 0.2, shifts_s: [-0.03]}"));
  for (size_t frame = 0; frame < 6; ++frame) {
    const std::optional<DeliveredImage> image = faults.deliver(kLeft, frame, stampOf(frame), imageOf(frame));
    EXPECT_EQ(image->stamp - stampOf(frame), std::chrono::milliseconds(frame < 3 ? 0 : -30));
    EXPECT_EQ(image->received, stampOf(frame));
  }
}

TEST(ImageFaultsTest, ImagesOfCamerasWithoutATriggerArriveAfterTheirExposure) {
  ImageFaults faults = make(
      read("image_stamp_shift: {cameras: [left, front], shifts_s: [0.03, -0.01], moves_exposure: true}"));
  const std::optional<DeliveredImage> image = faults.deliver(kLeft, 0, stampOf(0), imageOf(0));
  EXPECT_EQ(image->stamp - stampOf(0), std::chrono::milliseconds(30));
  EXPECT_EQ(image->received, image->stamp);
}

}  // namespace
}  // namespace vcharge
