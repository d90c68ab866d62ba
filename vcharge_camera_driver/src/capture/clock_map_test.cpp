#include "vcharge_camera_driver/clock_map.h"

#include <gtest/gtest.h>

namespace vcharge {
namespace {

// Two clocks set by the test.
struct Clocks {
  Timestamp monotonic = Timestamp::fromSeconds(100.0);
  Timestamp drive = Timestamp::fromSeconds(1000.0);
  void advance(double seconds, double drive_rate = 1.0) {
    monotonic = monotonic + durationFromSeconds(seconds);
    drive = drive + durationFromSeconds(seconds * drive_rate);
  }
  ClockMap map() {
    return ClockMap([this] { return drive; }, [this] { return monotonic; });
  }
};

TEST(ClockMapTest, MapsByTheOffsetOfTheClocks) {
  Clocks clocks;
  const ClockMap map = clocks.map();
  EXPECT_EQ(map.toDriveTime(Timestamp::fromSeconds(103.5)), Timestamp::fromSeconds(1003.5));
}

TEST(ClockMapTest, FollowsASlewedClockWithinAMicrosecondAndNoFasterThanItMay) {
  Clocks clocks;
  ClockMap map = clocks.map();
  for (int i = 0; i < 100; ++i) {
    clocks.advance(1.0, 1.0 + 500e-6);
    map.update();
    EXPECT_LT(std::abs(toSeconds(map.toDriveTime(clocks.monotonic) - clocks.drive)), 1e-6);
  }
  const Timestamp before = map.toDriveTime(clocks.monotonic);
  clocks.drive = clocks.drive + durationFromSeconds(0.009);  // smaller than a step: followed gradually
  clocks.advance(1.0);
  map.update();
  EXPECT_LE(toSeconds(map.toDriveTime(clocks.monotonic) - before), 1.0 + ClockMap::kMaxSlew + 1e-9);
  EXPECT_EQ(map.numSteps(), 0u);
}

TEST(ClockMapTest, TakesAStepAtOnceAndCountsIt) {
  Clocks clocks;
  ClockMap map = clocks.map();
  clocks.advance(1.0);
  clocks.drive = clocks.drive + durationFromSeconds(-30.0);
  map.update();
  EXPECT_EQ(map.toDriveTime(clocks.monotonic), clocks.drive);
  EXPECT_EQ(map.numSteps(), 1u);
}

TEST(ClockMapTest, TakesTheTightestOfItsReadings) {
  Timestamp monotonic = Timestamp::fromSeconds(0.0);
  int reading = 0;
  // The clocks agree; a reading of the drive's clock takes 1 ms, but once 10 us.
  const ClockMap map(
      [&] {
        const Timestamp value = monotonic;
        monotonic = monotonic + durationFromSeconds(++reading == 3 ? 10e-6 : 1e-3);
        return value;
      },
      [&] { return monotonic; });
  EXPECT_LE(std::abs(toSeconds(map.toDriveTime(monotonic) - monotonic)), 5.001e-6);
}

}  // namespace
}  // namespace vcharge
