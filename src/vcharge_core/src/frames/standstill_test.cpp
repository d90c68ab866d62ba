#include "vcharge_core/frames/standstill.h"

#include <gtest/gtest.h>

namespace vcharge {
namespace {

Timestamp at(double seconds) {
  return Timestamp::fromNanoseconds(10000000000LL) + durationFromSeconds(seconds);
}

/// Odometry at 50 Hz for 1 s, with constant velocities.
DriveOdometry driveWith(double speed_m_per_s, double yaw_rate_rad_per_s) {
  DriveOdometry odometry{FrameAssemblerOptions()};
  FrameCounters counters;
  for (int i = 0; i <= 50; ++i) {
    VehicleOdometry message;
    message.stamp = at(0.02 * i);
    message.odom_from_vehicle =
        RigidTransform::planar(0.02 * i * speed_m_per_s, 0.0, 0.02 * i * yaw_rate_rad_per_s);
    odometry.add(message, &counters);
  }
  return odometry;
}

TEST(StandstillTest, StandsBelowBothBounds) {
  EXPECT_TRUE(standsAt(driveWith(0.0, 0.0), at(0.51)));
  EXPECT_TRUE(standsAt(driveWith(0.019, 0.0), at(0.51)));
  EXPECT_TRUE(standsAt(driveWith(-0.019, 0.009), at(0.51)));
  EXPECT_FALSE(standsAt(driveWith(0.021, 0.0), at(0.51)));
  EXPECT_FALSE(standsAt(driveWith(-0.021, 0.0), at(0.51)));
  EXPECT_FALSE(standsAt(driveWith(0.0, 0.011), at(0.51)));
}

TEST(StandstillTest, AnUnknownPoseCountsAsStanding) {
  const DriveOdometry odometry = driveWith(1.0, 0.0);
  EXPECT_TRUE(standsAt(odometry, at(0.03)));
  EXPECT_FALSE(standsAt(odometry, at(0.05)));  // less than 0.1 s after the first pose
  EXPECT_TRUE(standsAt(driveWith(0.019, 0.0), at(0.05)));
  EXPECT_FALSE(standsAt(odometry, at(1.0)));
  EXPECT_TRUE(standsAt(odometry, at(1.01)));
  EXPECT_TRUE(standsAt(DriveOdometry{FrameAssemblerOptions()}, at(0.5)));
}

}  // namespace
}  // namespace vcharge
