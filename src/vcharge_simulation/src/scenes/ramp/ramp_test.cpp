#include "scenes/ramp/ramp_shape.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "scenes/catalogue_cases.h"
#include "vcharge_simulation/drive/drive_simulator.h"
#include "vcharge_simulation/drive/truth_maps.h"
#include "vcharge_simulation/scenes/scene_catalogue.h"

namespace vcharge {
namespace {

constexpr double kPi = 3.14159265358979323846;

TEST(RampTest, HeightIsAHelixBetweenRoundedEnds) {
  EXPECT_EQ(rampHeightAt(0.0), 0.0);
  const double middle_rad = 0.5 * kRampAngle_rad;
  EXPECT_NEAR((rampHeightAt(middle_rad + 0.1) - rampHeightAt(middle_rad - 0.1)) / (0.2 * kRampRadius_m),
              kRampSlope, 1e-9);
  // One turn higher, the height is that of a turn at the constant slope.
  EXPECT_NEAR(rampHeightAt(0.6 + 2.0 * kPi) - rampHeightAt(0.6), kRampSlope * 2.0 * kPi * kRampRadius_m,
              1e-9);
  EXPECT_NEAR(landingHeight(), kRampSlope * (kRampLength_m - kRampRounding_m), 1e-9);
}

TEST(RampTest, GroundIsTheNearestOfAllLevels) {
  const double x = kRampRadius_m * std::cos(0.6);
  const double y = kRampRadius_m * std::sin(0.6);
  EXPECT_NEAR(rampGroundHeight(x, y, -1.0), rampHeightAt(0.6), 1e-9);  // no room under the beginning
  const double opposite_m = rampHeightAt(0.6 + kPi);
  EXPECT_EQ(rampGroundHeight(-x, -y, 0.3), 0.0);
  EXPECT_NEAR(rampGroundHeight(-x, -y, opposite_m - 0.3), opposite_m, 1e-9);
  EXPECT_NEAR(rampGroundHeight(x, y, rampHeightAt(0.6) + 0.3), rampHeightAt(0.6), 1e-9);
  EXPECT_NEAR(rampGroundHeight(x, y, std::numeric_limits<double>::infinity()), rampHeightAt(0.6 + 2.0 * kPi),
              1e-9);
  EXPECT_EQ(rampGroundHeight(20.0, 0.0, 5.0), 0.0);
}

// The car's pose on the helix is known in closed form: its heading turns by 1 / radius and its height grows
// by the slope per metre along the middle of the lane, and its pitch is that of the lane.
TEST(RampTest, PosesOfTheDrivesFollowTheHelix) {
  for (const bool is_up : {true, false}) {
    DrivePlan plan = planDrive("ramp", is_up ? "up" : "down");
    plan.motion.road_noise_rad = plan.motion.road_heave_m = 0.0;
    const SimulatedDrive drive = simulateDrive(plan.path, plan.motion, WheelOdometerOptions(), 1, 1,
                                               FaultOptions(), plan.ground_height);
    const auto heightOf = [](const VehicleOdometry& truth) {
      return truth.odom_from_vehicle.translation().z();
    };
    EXPECT_NEAR(heightOf(drive.ground_truth.front()), is_up ? 0.0 : landingHeight(), 1e-6);
    EXPECT_NEAR(heightOf(drive.ground_truth.back()), is_up ? landingHeight() : 0.0, 1e-6);
    double turned_rad = is_up ? 0.0 : kRampAngle_rad;
    double last_rad = is_up ? 0.0 : 0.5 * kPi;
    int on_helix = 0;
    for (const VehicleOdometry& truth : drive.ground_truth) {
      const Eigen::Vector3d position_m = truth.odom_from_vehicle.translation();
      const double angle_rad = std::atan2(position_m.y(), position_m.x());
      const bool is_before = on_helix == 0 && (is_up ? position_m.y() : position_m.x()) < 0.0;
      const bool is_after = on_helix > 0 && (is_up ? turned_rad > kRampAngle_rad - 0.4 : turned_rad < 0.4);
      if (is_before || is_after) {
        last_rad = angle_rad;
        continue;
      }
      turned_rad += std::remainder(angle_rad - last_rad, 2.0 * kPi);
      last_rad = angle_rad;
      ++on_helix;
      if (turned_rad < 0.7 || turned_rad > kRampAngle_rad - 0.7) {
        continue;  // the ends are rounded, and the car is longer than they are
      }
      EXPECT_NEAR(position_m.head<2>().norm(), kRampRadius_m, 0.02);
      EXPECT_NEAR(position_m.z(), rampHeightAt(turned_rad), 0.01);
      const Eigen::Vector3d ahead = truth.odom_from_vehicle.rotation() * Eigen::Vector3d::UnitX();
      EXPECT_NEAR(std::remainder(std::atan2(ahead.y(), ahead.x()) - angle_rad - (is_up ? 0.5 : -0.5) * kPi,
                                 2.0 * kPi),
                  0.0, 0.01);
      EXPECT_NEAR(ahead.z(), (is_up ? 1.0 : -1.0) * kRampSlope, 0.015);
    }
    EXPECT_GT(on_helix, 900);  // 50 Hz over more than a turn
  }
}

TEST(RampTest, HeightMapHoldsTheUppermostLevel) {
  const Renderer& renderer = rendererOf("ramp");
  const TruthHeightMap map = computeHeightMap(renderer, 0.2, 2.5);
  int checked = 0;
  // Before half a turn, walls of the landing cross the lane.
  for (double angle_rad = kPi + 0.1; angle_rad < kRampAngle_rad - 0.1; angle_rad += 0.04) {
    const Eigen::Vector2d position_m =
        kRampRadius_m * Eigen::Vector2d(std::cos(angle_rad), std::sin(angle_rad));
    const Eigen::Vector2d cell = (position_m - map.origin_m) / map.cell_size_m;
    const Eigen::Vector2d centre_m =
        map.origin_m + map.cell_size_m * Eigen::Vector2d(std::round(cell.x()), std::round(cell.y()));
    const double height_m = map.height_m.at<float>(static_cast<int>(std::lround(cell.y())),
                                                   static_cast<int>(std::lround(cell.x())));
    const double expected_m =
        rampGroundHeight(centre_m.x(), centre_m.y(), std::numeric_limits<double>::infinity());
    EXPECT_NEAR(height_m, expected_m, 0.01) << angle_rad;
    ++checked;
  }
  EXPECT_GT(checked, 100);
}

}  // namespace
}  // namespace vcharge
