#pragma once

#include "vcharge_simulation/scenes/ground_height.h"

namespace vcharge {

/// A helical ramp about the z axis that turns left as it rises, from the x axis over kRampTurns, and a level
/// landing at its upper end, along -x.
inline constexpr double kRampRadius_m = 9.0;  ///< to the middle of the lane
inline constexpr double kRampHalfWidth_m = 2.25;
inline constexpr double kRampSlope = 0.1;  ///< in the middle of the lane
inline constexpr double kRampTurns = 1.25;
inline constexpr double kRampAngle_rad = kRampTurns * 6.28318530717958647692;
inline constexpr double kRampLength_m =
    kRampAngle_rad * kRampRadius_m;             ///< along the middle, seen from above
inline constexpr double kRampRounding_m = 3.0;  ///< at both ends, where the slope changes linearly
inline constexpr double kLandingLength_m = 15.0;
inline constexpr double kRampSkirt_m = 2.2;  ///< where it is lower, the ramp is closed down to the ground

/// Height of the ramp at this angle from its lower end, in [0, kRampAngle_rad].
double rampHeightAt(double angle_rad);
inline double landingHeight() {
  return rampHeightAt(kRampAngle_rad);
}
/// The drivable level nearest to a height: the ground at z = 0, a turn of the ramp, or the landing. The
/// uppermost level at an infinite height.
double rampGroundHeight(double x_m, double y_m, double near_z_m);

}  // namespace vcharge
