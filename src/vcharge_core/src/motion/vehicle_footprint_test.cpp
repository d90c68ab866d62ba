#include "vcharge_core/motion/vehicle_footprint.h"

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

TEST(VehicleFootprintTest, RefusesVehiclesThatCannotBe) {
  EXPECT_THROW(read("{length_m: 3.0}"), InputError);
  EXPECT_THROW(read("{width_m: -1.0}"), InputError);
  EXPECT_THROW(read("{turning_circle_m: 5.0}"), InputError);
  EXPECT_THROW(read("{height_m: 1.5}"), InputError);
}

}  // namespace
}  // namespace vcharge
