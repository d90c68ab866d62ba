#include "monitor/camera_sight.h"

#include <gtest/gtest.h>

namespace vcharge {
namespace {

using Seen = std::vector<CameraSight::Seen>;

TEST(CameraSightTest, TellsACameraThatSeesLessThanUsual) {
  CameraSight sight(3);
  for (int i = 0; i < 5; ++i) {
    for (const double each : sight.add({{1000, 80.0}, {2000, 90.0}, {400, 80.0}}, 10.0)) {
      EXPECT_NEAR(each, 1.0, 1e-9);  // cameras need not see the same
    }
  }
  for (int i = 0; i < 100; ++i) {
    EXPECT_NEAR(sight.add({{1000, 80.0}, {200, 95.0}, {400, 80.0}}, 10.0)[1], 0.1, 1e-9)
        << "a dirty lens does not become usual";
  }
  EXPECT_NEAR(sight.add({{500, 80.0}, {1000, 90.0}, {200, 80.0}}, 5.0)[1], 1.0, 1e-9) << "a shorter part";
}

TEST(CameraSightTest, DarknessIsNoDirt) {
  CameraSight sight(3);
  const Seen lit{{1000, 80.0}, {2000, 80.0}, {400, 80.0}};
  sight.add(lit, 10.0);
  sight.add(lit, 10.0);
  // Everywhere, on one side, and without any light.
  for (const Seen& dark :
       {Seen{{100, 75.0}, {200, 75.0}, {40, 75.0}}, Seen{{1000, 80.0}, {2000, 80.0}, {10, 30.0}},
        Seen{{0, 5.0}, {0, 5.0}, {0, 5.0}}}) {
    for (const double each : sight.add(dark, 10.0)) {
      EXPECT_NEAR(each, 1.0, 1e-9);
    }
  }
  // A side that was dark from the beginning is not what is usual.
  CameraSight begun_in_the_dark(3);
  for (int i = 0; i < 4; ++i) {
    begun_in_the_dark.add({{1000, 80.0}, {2000, 80.0}, {10, 30.0}}, 10.0);
  }
  EXPECT_NEAR(begun_in_the_dark.add({{1000, 80.0}, {2000, 80.0}, {400, 80.0}}, 10.0)[2], 1.0, 1e-9);
  EXPECT_EQ(sight.add({{0, 80.0}, {0, 80.0}, {0, 80.0}}, 0.0), std::vector<double>(3, 1.0)) << "standing";
}

}  // namespace
}  // namespace vcharge
