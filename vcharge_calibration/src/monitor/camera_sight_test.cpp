#include "monitor/camera_sight.h"

#include <gtest/gtest.h>

namespace vcharge {
namespace {

TEST(CameraSightTest, TellsACameraThatSeesLessThanUsual) {
  CameraSight sight(3);
  for (int i = 0; i < 5; ++i) {
    for (const double each : sight.add({1000, 2000, 400}, 10.0)) {
      EXPECT_NEAR(each, 1.0, 1e-9);  // cameras need not see the same
    }
  }
  for (int i = 0; i < 100; ++i) {
    EXPECT_NEAR(sight.add({1000, 200, 400}, 10.0)[1], 0.1, 1e-9) << "a dirty lens does not become usual";
  }
  EXPECT_NEAR(sight.add({500, 1000, 200}, 5.0)[1], 1.0, 1e-9) << "a shorter part";
}

TEST(CameraSightTest, DarknessIsNoDirt) {
  CameraSight sight(3);
  sight.add({1000, 2000, 400}, 10.0);
  sight.add({1000, 2000, 400}, 10.0);
  for (const std::vector<int64_t>& dark :
       {std::vector<int64_t>{100, 200, 40}, std::vector<int64_t>{0, 0, 0}}) {
    for (const double each : sight.add(dark, 10.0)) {
      EXPECT_NEAR(each, 1.0, 1e-9);
    }
  }
  EXPECT_EQ(sight.add({0, 0, 0}, 0.0), std::vector<double>(3, 1.0)) << "standing";
}

}  // namespace
}  // namespace vcharge
