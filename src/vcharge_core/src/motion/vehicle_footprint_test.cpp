#include "vcharge_core/motion/vehicle_footprint.h"

#include <algorithm>
#include <cmath>
#include <string>

#include <gtest/gtest.h>

#include "vcharge_core/base/error.h"

namespace vcharge {
namespace {

VehicleFootprint read(const std::string& text) {
  VehicleFootprint vehicle;
  readFields(YAML::Load(text), "vehicle.yaml", &vehicle);
  return vehicle;
}

TEST(VehicleFootprintTest, TellsTheOutlineFromTheRearAxle) {
  const VehicleOutline outline = read("{length_m: 5.0, rear_overhang_m: 1.0, width_m: 2.0}").outline();
  EXPECT_DOUBLE_EQ(outline.front_m, 4.0);
  EXPECT_DOUBLE_EQ(outline.rear_m, -1.0);
  EXPECT_DOUBLE_EQ(outline.half_width_m, 1.0);
}

TEST(VehicleFootprintTest, TurnsItsOuterFrontWheelOnTheTurningCircle) {
  // The wheel is at (3, radius + 1) from the centre of the turn: a triangle of sides 3, 4 and 5.
  const VehicleFootprint vehicle = read("{wheelbase_m: 3.0, width_m: 2.0, turning_circle_m: 10.0}");
  EXPECT_DOUBLE_EQ(vehicle.minTurningRadius_m(), 3.0);
}

TEST(VehicleFootprintTest, LeavesTheShortestGapInOneMove) {
  // Drives out of the gap in small steps until its front corner is beside the vehicle ahead.
  const VehicleFootprint vehicle;
  const VehicleOutline outline = vehicle.outline();
  const double radius_m = vehicle.minTurningRadius_m();
  double ahead_m = 0.0;
  for (double turn_rad = 0.0; turn_rad < 1.5; turn_rad += 1e-5) {
    const double side_m = radius_m + outline.half_width_m;
    const double x_m = outline.front_m * std::cos(turn_rad) + side_m * std::sin(turn_rad);
    const double y_m = radius_m + outline.front_m * std::sin(turn_rad) - side_m * std::cos(turn_rad);
    if (y_m > outline.half_width_m) {
      break;
    }
    ahead_m = std::max(ahead_m, x_m);
  }
  EXPECT_NEAR(vehicle.minParallelGap_m(), ahead_m - outline.rear_m, 1e-3);
}

TEST(VehicleFootprintTest, RefusesVehiclesThatCannotBe) {
  EXPECT_THROW(read("{length_m: 3.0}"), InputError);
  EXPECT_THROW(read("{width_m: -1.0}"), InputError);
  EXPECT_THROW(read("{turning_circle_m: 5.0}"), InputError);
  EXPECT_THROW(read("{height_m: 1.5}"), InputError);
}

}  // namespace
}  // namespace vcharge
