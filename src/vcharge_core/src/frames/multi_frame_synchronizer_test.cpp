#include "vcharge_core/frames/multi_frame_synchronizer.h"

#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace vcharge {
namespace {

Timestamp at(double seconds) {
  return Timestamp::fromNanoseconds(1000000000000) + durationFromSeconds(seconds);
}

Image imageWith(int value) {
  return {cv::Mat(1, 1, CV_8UC1, cv::Scalar(value)), nullptr};
}

TEST(MultiFrameSynchronizerTest, EmitsASetWhenItIsComplete) {
  MultiFrameSynchronizer synchronizer(2);
  EXPECT_EQ(synchronizer.add(1, at(0.0), imageWith(11)), nullptr);
  const auto frame = synchronizer.add(0, at(0.0), imageWith(10));
  ASSERT_NE(frame, nullptr);
  EXPECT_EQ(frame->stamp, at(0.0));
  EXPECT_EQ(frame->images[0].pixels.at<uint8_t>(0, 0), 10);
  EXPECT_EQ(frame->images[1].pixels.at<uint8_t>(0, 0), 11);
}

TEST(MultiFrameSynchronizerTest, KeepsThePixelsWhereTheyAre) {
  MultiFrameSynchronizer synchronizer(1);
  const Image image = imageWith(5);
  const auto frame = synchronizer.add(0, at(0.0), image);
  ASSERT_NE(frame, nullptr);
  EXPECT_EQ(frame->images[0].pixels.data, image.pixels.data);
}

TEST(MultiFrameSynchronizerTest, ExactStampsByDefaultToleranceAsAnOption) {
  MultiFrameSynchronizer exact(2);
  exact.add(0, at(0.0), imageWith(0));
  EXPECT_EQ(exact.add(1, at(1e-6), imageWith(0)), nullptr);

  MultiFrameSynchronizerOptions options;
  options.tolerance_s = 0.005;
  MultiFrameSynchronizer tolerant(2, options);
  tolerant.add(0, at(0.004), imageWith(0));
  const auto frame = tolerant.add(1, at(0.0), imageWith(0));
  ASSERT_NE(frame, nullptr);
  EXPECT_EQ(frame->stamp, at(0.0));
  EXPECT_EQ(tolerant.add(0, at(0.08), imageWith(0)), nullptr);
  EXPECT_EQ(tolerant.add(1, at(0.086), imageWith(0)), nullptr) << "6 ms apart";
}

TEST(MultiFrameSynchronizerTest, ACompleteSetOvertakesIncompleteOnesAndCountsThem) {
  MultiFrameSynchronizer synchronizer(3);
  synchronizer.add(0, at(0.0), imageWith(0));
  synchronizer.add(1, at(0.0), imageWith(0));
  for (size_t camera = 0; camera < 3; ++camera) {
    synchronizer.add(camera, at(0.08), imageWith(0));
  }
  EXPECT_EQ(synchronizer.counts().complete_sets, 1U);
  EXPECT_EQ(synchronizer.counts().incomplete_sets, 1U);
  EXPECT_EQ(synchronizer.counts().missing_per_camera, (std::vector<uint64_t>{0, 0, 1}));
  EXPECT_EQ(synchronizer.add(2, at(0.0), imageWith(0)), nullptr) << "too late";
  EXPECT_EQ(synchronizer.counts().late_images, 1U);
}

TEST(MultiFrameSynchronizerTest, ADeadCameraDoesNotFillTheMemory) {
  MultiFrameSynchronizer synchronizer(2);
  for (int i = 0; i < 100; ++i) {
    EXPECT_EQ(synchronizer.add(0, at(0.08 * i), imageWith(0)), nullptr);
  }
  EXPECT_EQ(synchronizer.counts().incomplete_sets, 92U);
  EXPECT_EQ(synchronizer.counts().missing_per_camera[1], 92U);
  EXPECT_NE(synchronizer.add(1, at(0.08 * 99), imageWith(0)), nullptr) << "it recovers";
}

TEST(MultiFrameSynchronizerTest, CountsDuplicatesAndKeepsTheFirst) {
  MultiFrameSynchronizer synchronizer(2);
  synchronizer.add(0, at(0.0), imageWith(1));
  synchronizer.add(0, at(0.0), imageWith(2));
  const auto frame = synchronizer.add(1, at(0.0), imageWith(3));
  ASSERT_NE(frame, nullptr);
  EXPECT_EQ(frame->images[0].pixels.at<uint8_t>(0, 0), 1);
  EXPECT_EQ(synchronizer.counts().duplicate_images, 1U);
}

TEST(MultiFrameSynchronizerTest, StartsOverWhenTimeJumpsBack) {
  MultiFrameSynchronizer synchronizer(1);
  EXPECT_NE(synchronizer.add(0, at(100.0), imageWith(0)), nullptr);
  EXPECT_NE(synchronizer.add(0, at(1.0), imageWith(0)), nullptr);
  EXPECT_EQ(synchronizer.counts().resets, 1U);
}

TEST(MultiFrameSynchronizerTest, StartingOverGivesUpWhatWaits) {
  MultiFrameSynchronizer synchronizer(2);
  synchronizer.add(0, at(100.0), imageWith(1));
  EXPECT_EQ(synchronizer.add(1, at(1.0), imageWith(2)), nullptr);
  EXPECT_EQ(synchronizer.counts().incomplete_sets, 1U);
  EXPECT_EQ(synchronizer.counts().missing_per_camera, (std::vector<uint64_t>{0, 1}));
  const auto frame = synchronizer.add(0, at(1.0), imageWith(3));
  ASSERT_NE(frame, nullptr);
  EXPECT_EQ(frame->images[0].pixels.at<uint8_t>(0, 0), 3) << "not the image from before the jump";
}

TEST(MultiFrameSynchronizerTest, AStepBackThatIsNoRestartIsLate) {
  MultiFrameSynchronizer synchronizer(1);
  EXPECT_NE(synchronizer.add(0, at(10.0), imageWith(0)), nullptr);
  EXPECT_EQ(synchronizer.add(0, at(9.5), imageWith(0)), nullptr);
  EXPECT_EQ(synchronizer.counts().late_images, 1U);
  EXPECT_EQ(synchronizer.counts().resets, 0U);
}

TEST(MultiFrameSynchronizerTest, CompletesInterleavedSetsInOrderOfTime) {
  MultiFrameSynchronizer synchronizer(2);
  EXPECT_EQ(synchronizer.add(0, at(0.0), imageWith(0)), nullptr);
  EXPECT_EQ(synchronizer.add(0, at(0.08), imageWith(1)), nullptr);
  const auto first = synchronizer.add(1, at(0.0), imageWith(0));
  const auto second = synchronizer.add(1, at(0.08), imageWith(1));
  ASSERT_NE(first, nullptr);
  ASSERT_NE(second, nullptr);
  EXPECT_EQ(first->stamp, at(0.0));
  EXPECT_EQ(second->stamp, at(0.08));
  EXPECT_EQ(second->images[0].pixels.at<uint8_t>(0, 0), 1);
  EXPECT_EQ(synchronizer.counts().complete_sets, 2U);
  EXPECT_EQ(synchronizer.counts().incomplete_sets, 0U);
}

TEST(MultiFrameSynchronizerTest, AnImageGoesToTheNearestSet) {
  MultiFrameSynchronizerOptions options;
  options.tolerance_s = 0.05;
  MultiFrameSynchronizer synchronizer(2, options);
  synchronizer.add(0, at(0.0), imageWith(1));
  synchronizer.add(0, at(0.06), imageWith(2));
  const auto frame = synchronizer.add(1, at(0.04), imageWith(3));  // within tolerance of both
  ASSERT_NE(frame, nullptr);
  EXPECT_EQ(frame->images[0].pixels.at<uint8_t>(0, 0), 2);
}

TEST(MultiFrameSynchronizerTest, NoSetSpansMoreThanTheTolerance) {
  MultiFrameSynchronizerOptions options;
  options.tolerance_s = 0.005;
  MultiFrameSynchronizer synchronizer(3, options);
  synchronizer.add(0, at(0.010), imageWith(0));
  synchronizer.add(1, at(0.006), imageWith(1));
  // Close to the second image and 8 ms from the first.
  EXPECT_EQ(synchronizer.add(2, at(0.002), imageWith(2)), nullptr);
  const auto frame = synchronizer.add(2, at(0.009), imageWith(3));
  ASSERT_NE(frame, nullptr);
  EXPECT_EQ(frame->stamp, at(0.006));
  EXPECT_EQ(frame->images[2].pixels.at<uint8_t>(0, 0), 3);
}

TEST(MultiFrameSynchronizerTest, KeepsIncompleteSetsInOrderWhereAsked) {
  MultiFrameSynchronizerOptions options;
  options.keep_incomplete = true;
  MultiFrameSynchronizer synchronizer(2, options);
  synchronizer.add(1, at(0.1), imageWith(1));
  synchronizer.add(0, at(0.2), imageWith(2));
  synchronizer.add(0, at(0.3), imageWith(3));
  EXPECT_TRUE(synchronizer.takeIncomplete().empty());
  synchronizer.giveUpUntil(at(0.1));
  auto sets = synchronizer.takeIncomplete();
  ASSERT_EQ(sets.size(), 1u);
  EXPECT_EQ(sets[0]->stamp, at(0.1));
  EXPECT_TRUE(sets[0]->images[0].pixels.empty());
  EXPECT_EQ(sets[0]->images[1].pixels.at<uint8_t>(0, 0), 1);
  ASSERT_NE(synchronizer.add(1, at(0.3), imageWith(4)), nullptr);  // overtakes
  sets = synchronizer.takeIncomplete();
  ASSERT_EQ(sets.size(), 1u);
  EXPECT_EQ(sets[0]->stamp, at(0.2));
  EXPECT_TRUE(synchronizer.takeIncomplete().empty());
  EXPECT_EQ(synchronizer.add(0, at(0.1), imageWith(5)), nullptr);
  EXPECT_EQ(synchronizer.counts().late_images, 1u);
}

TEST(MultiFrameSynchronizerTest, RejectsBadOptionsByName) {
  const auto errorOf = [](const auto& change) -> std::string {
    MultiFrameSynchronizerOptions options;
    change(&options);
    try {
      MultiFrameSynchronizer synchronizer(2, options);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "no error";
  };
  using ::testing::StartsWith;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(errorOf([](auto* o) { o->tolerance_s = -0.001; }), StartsWith("tolerance_s: "));
  EXPECT_THAT(errorOf([&](auto* o) { o->tolerance_s = nan; }), StartsWith("tolerance_s: "));
  EXPECT_THAT(errorOf([](auto* o) { o->tolerance_s = std::numeric_limits<double>::infinity(); }),
              StartsWith("tolerance_s: "));
}

TEST(MultiFrameSynchronizerTest, BadIndexIsACallersBug) {
  MultiFrameSynchronizer synchronizer(2);
  EXPECT_THROW(synchronizer.add(2, at(0.0), imageWith(0)), std::logic_error);
  EXPECT_THROW(MultiFrameSynchronizer(0), std::logic_error);
}

}  // namespace
}  // namespace vcharge
