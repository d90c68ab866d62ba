#include "vcharge_core/vehicle_odometry.h"

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

TEST(OdometryBufferTest, IgnoresDuplicatesAndSmallStepsBack) {
  OdometryBuffer buffer;
  buffer.add(odometryAt(0.0));
  buffer.add(odometryAt(0.1));
  EXPECT_EQ(buffer.add(odometryAt(0.1)), AddResult::kDuplicate);
  EXPECT_EQ(buffer.add(odometryAt(0.0)), AddResult::kDuplicate);
  EXPECT_EQ(buffer.add(odometryAt(0.05)), AddResult::kOutOfOrder);
  EXPECT_EQ(buffer.counts().duplicates, 2U);
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

TEST(OdometryBufferTest, RejectsBadOptionsByName) {
  OdometryBufferOptions options;
  options.max_gap_s = 0.0;
  try {
    OdometryBuffer buffer(options);
    FAIL();
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("max_gap_s"), std::string::npos);
  }
}

}  // namespace
}  // namespace vcharge
