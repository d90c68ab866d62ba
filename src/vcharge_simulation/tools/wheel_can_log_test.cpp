#include "wheel_can_log.h"

#include <gtest/gtest.h>

namespace vcharge {
namespace {

TEST(WheelCanLogTest, HoldsTheStepsOfAnglesAndSpeedsAsLittleEndianNumbers) {
  WheelSpeeds speeds;
  speeds.stamp = Timestamp::fromNanoseconds(1'400'000'000'020'000'000);
  speeds.rear_left_m_per_s = 2.5;     // 2500 = 0x09C4
  speeds.rear_right_m_per_s = -0.01;  // -10 = 0xFFF6
  speeds.steering_angle_rad = 0.02;   // 200 = 0x00C8
  EXPECT_EQ(wheelCanLog({speeds}),
            "(1400000000.020000) can0 101#C800\n(1400000000.020000) can0 102#C409F6FF00800080\n");
}

}  // namespace
}  // namespace vcharge
