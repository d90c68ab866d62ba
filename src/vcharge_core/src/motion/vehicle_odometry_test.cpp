#include "vcharge_core/motion/vehicle_odometry.h"

#include <cmath>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace vcharge {
namespace {

using AddResult = OdometryBuffer::AddResult;
using LookupStatus = OdometryBuffer::LookupStatus;

Timestamp at(double seconds) {
  return Timestamp::fromNanoseconds(1000000000000) + durationFromSeconds(seconds);
}

VehicleOdometry odometryAt(double seconds) {
  return {at(seconds), RigidTransform::planar(2.0 * seconds, 0.0, 0.1 * seconds), 2.0, 0.1};
}

TEST(OdometryBufferTest, InterpolatesBetweenStamps) {
  OdometryBuffer buffer;
  EXPECT_EQ(buffer.lookup(at(0.0)).status, LookupStatus::kEmpty);
  EXPECT_EQ(buffer.add(odometryAt(0.0)), AddResult::kAdded);
  EXPECT_EQ(buffer.add(odometryAt(0.1)), AddResult::kAdded);
  const auto middle = buffer.lookup(at(0.025));
  ASSERT_TRUE(middle);
  EXPECT_EQ(middle.odometry.stamp, at(0.025));
  EXPECT_NEAR(middle.odometry.odom_from_vehicle.translation().x(), 0.05, 1e-12);
  EXPECT_NEAR(yawOfRotation(middle.odometry.odom_from_vehicle.rotation()), 0.0025, 1e-12);
  EXPECT_TRUE(buffer.lookup(at(0.0)));
  EXPECT_TRUE(buffer.lookup(at(0.1)));
}

TEST(OdometryBufferTest, NeverExtrapolates) {
  OdometryBuffer buffer;
  buffer.add(odometryAt(0.0));
  buffer.add(odometryAt(0.1));
  EXPECT_EQ(buffer.lookup(at(-1e-9)).status, LookupStatus::kBeforeFirst);
  EXPECT_EQ(buffer.lookup(at(0.1 + 1e-9)).status, LookupStatus::kAfterLast);
}

TEST(OdometryBufferTest, ReportsGapsAndDoesNotBridgeThem) {
  OdometryBufferOptions options;
  options.max_gap_s = 0.2;
  OdometryBuffer buffer(options);
  buffer.add(odometryAt(0.0));
  EXPECT_EQ(buffer.add(odometryAt(0.5)), AddResult::kAddedAfterGap);
  EXPECT_EQ(buffer.lookup(at(0.25)).status, LookupStatus::kInGap);
  EXPECT_TRUE(buffer.lookup(at(0.5)));
  EXPECT_EQ(buffer.counts().gaps, 1U);
}

TEST(OdometryBufferTest, ARepeatedStampCorrectsItsEntryAndSmallStepsBackAreIgnored) {
  OdometryBuffer buffer;
  buffer.add(odometryAt(0.0));
  buffer.add(odometryAt(0.1));
  VehicleOdometry corrected = odometryAt(0.1);
  corrected.odom_from_vehicle = RigidTransform::planar(7.0, 0.0, 0.0);
  EXPECT_EQ(buffer.add(corrected), AddResult::kCorrected);
  EXPECT_EQ(buffer.lookup(at(0.1)).odometry.odom_from_vehicle.translation().x(), 7.0);
  EXPECT_EQ(buffer.add(odometryAt(0.0)), AddResult::kCorrected);
  EXPECT_EQ(buffer.add(odometryAt(0.05)), AddResult::kOutOfOrder);
  EXPECT_EQ(buffer.counts().corrections, 2U);
  EXPECT_EQ(buffer.counts().out_of_order, 1U);
  EXPECT_EQ(buffer.counts().added, 2U);
}

TEST(OdometryBufferTest, StartsOverWhenTimeJumpsBack) {
  OdometryBuffer buffer;
  buffer.add(odometryAt(100.0));
  EXPECT_EQ(buffer.add(odometryAt(1.0)), AddResult::kReset);
  EXPECT_EQ(buffer.lookup(at(100.0)).status, LookupStatus::kAfterLast);
  EXPECT_TRUE(buffer.lookup(at(1.0)));
  EXPECT_EQ(buffer.counts().resets, 1U);
}

TEST(OdometryBufferTest, ForgetsWhatIsOlderThanItsHistory) {
  OdometryBufferOptions options;
  options.history_s = 1.0;
  OdometryBuffer buffer(options);
  for (int i = 0; i <= 20; ++i) {
    buffer.add(odometryAt(0.1 * i));
  }
  EXPECT_EQ(buffer.lookup(at(0.5)).status, LookupStatus::kBeforeFirst);
  EXPECT_TRUE(buffer.lookup(at(1.5)));
}

TEST(OdometryBufferTest, InterpolatesVelocities) {
  OdometryBuffer buffer;
  buffer.add({at(0.0), RigidTransform(), 1.0, -0.2});
  buffer.add({at(0.2), RigidTransform(), 3.0, 0.6});
  const auto lookup = buffer.lookup(at(0.05));
  ASSERT_TRUE(lookup);
  EXPECT_NEAR(lookup.odometry.forward_speed_m_per_s, 1.5, 1e-12);
  EXPECT_NEAR(lookup.odometry.yaw_rate_rad_per_s, 0.0, 1e-12);
}

TEST(OdometryBufferTest, TurnsTheShortWayAcrossPi) {
  OdometryBuffer buffer;
  buffer.add({at(0.0), RigidTransform::planar(0.0, 0.0, M_PI - 0.1)});
  buffer.add({at(0.2), RigidTransform::planar(0.0, 0.0, -M_PI + 0.3)});
  const auto lookup = buffer.lookup(at(0.1));
  ASSERT_TRUE(lookup);
  EXPECT_NEAR(yawOfRotation(lookup.odometry.odom_from_vehicle.rotation()), -M_PI + 0.1, 1e-12);
}

TEST(OdometryBufferTest, AnInfiniteHistoryKeepsEverything) {
  OdometryBufferOptions options;
  options.history_s = std::numeric_limits<double>::infinity();
  OdometryBuffer buffer(options);
  for (int i = 0; i <= 1000; ++i) {
    buffer.add(odometryAt(0.2 * i));
  }
  EXPECT_TRUE(buffer.lookup(at(0.1)));
  EXPECT_EQ(buffer.counts().added, 1001U);
}

TEST(OdometryBufferTest, KnowsItsNewestStamp) {
  OdometryBuffer buffer;
  EXPECT_TRUE(buffer.empty());
  EXPECT_EQ(buffer.newestStamp(), std::nullopt);
  buffer.add(odometryAt(100.0));
  buffer.add(odometryAt(100.1));
  buffer.add(odometryAt(100.05));  // too old, ignored
  EXPECT_FALSE(buffer.empty());
  EXPECT_EQ(buffer.newestStamp(), at(100.1));
  buffer.add(odometryAt(1.0));  // jump backwards, resets the buffer
  EXPECT_EQ(buffer.newestStamp(), at(1.0));
}

TEST(OdometryBufferTest, StartsOverAfterAJumpOfOneSecond) {
  OdometryBuffer buffer;
  buffer.add(odometryAt(10.0));
  EXPECT_EQ(buffer.add(odometryAt(9.01)), AddResult::kOutOfOrder);
  EXPECT_EQ(buffer.add(odometryAt(9.0)), AddResult::kReset);
}

TEST(OdometryBufferTest, DescribesEachStatusInWordsOfItsOwn) {
  EXPECT_EQ(describe(LookupStatus::kEmpty), "no odometry yet");
  EXPECT_EQ(describe(LookupStatus::kBeforeFirst), "before the first odometry");
  EXPECT_EQ(describe(LookupStatus::kAfterLast), "after the last odometry");
  EXPECT_EQ(describe(LookupStatus::kInGap), "inside a gap of the odometry");
}

TEST(OdometryBufferTest, RejectsBadOptionsByName) {
  for (const double bad : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
    const auto errorOf = [&](double OdometryBufferOptions::*field) -> std::string {
      OdometryBufferOptions options;
      options.*field = bad;
      try {
        OdometryBuffer buffer(options);
      } catch (const std::invalid_argument& error) {
        return error.what();
      }
      return "no error";
    };
    using ::testing::StartsWith;
    EXPECT_THAT(errorOf(&OdometryBufferOptions::max_gap_s), StartsWith("max_gap_s: "));
    EXPECT_THAT(errorOf(&OdometryBufferOptions::history_s), StartsWith("history_s: "));
  }
}

}  // namespace
}  // namespace vcharge
