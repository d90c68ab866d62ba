#pragma once

#include <cmath>

#include "vcharge_core/base/options.h"

namespace vcharge {

/// Rectangle around the vehicle, in its own frame (x forward, y left).
struct VehicleOutline {
  double front_m = 0.0;  ///< front end along x
  double rear_m = 0.0;   ///< rear end along x, below front_m
  double half_width_m = 0.0;
};

/// The ground that the vehicle covers, and how narrow it turns. The origin of the vehicle's frame lies on the
/// ground below the middle of the rear axle.
struct VehicleFootprint {
  VCHARGE_BEGIN_OPTIONS(VehicleFootprint);
  VCHARGE_OPTION(double, length_m, 4.7, positive(), "Length of the vehicle, with a margin.");
  VCHARGE_OPTION(double, width_m, 1.9, positive(), "Width of the vehicle, with mirrors and a margin.");
  VCHARGE_OPTION(double, rear_overhang_m, 0.95, positive(),
                 "Distance from the rear axle to the rear end of that length.");
  VCHARGE_OPTION(double, wheelbase_m, 2.58, positive(), "Distance between the axles.");
  VCHARGE_OPTION(double, turning_circle_m, 10.9, positive(),
                 "Diameter of the smallest circle that the outer front wheel drives.");
  VCHARGE_END_OPTIONS();

  void checkFields() const {
    requireField(length_m > rear_overhang_m + wheelbase_m, "length_m",
                 "must be above rear_overhang_m + wheelbase_m", length_m);
    requireField(0.5 * turning_circle_m > std::hypot(wheelbase_m, 0.5 * width_m), "turning_circle_m",
                 "must be above the circle of a vehicle that turns about its rear axle", turning_circle_m);
  }

  VehicleOutline outline() const { return {length_m - rear_overhang_m, -rear_overhang_m, 0.5 * width_m}; }
  /// Radius of the narrowest circle of the frame's origin. The front wheels are taken to stand as far out as
  /// the sides of the vehicle.
  double minTurningRadius_m() const {
    return std::sqrt(0.25 * turning_circle_m * turning_circle_m - wheelbase_m * wheelbase_m) - 0.5 * width_m;
  }
  /// Shortest gap between two parked vehicles that the vehicle leaves forwards in one move. It stands at the
  /// one behind and in line with the one ahead, whose near corner its own front corner, on the far side, just
  /// passes on the narrowest circle: in that circle's centre, front_m^2 + (r + w / 2)^2 = x^2 + (r - w /
  /// 2)^2.
  double minParallelGap_m() const {
    const double front_m = outline().front_m;
    return rear_overhang_m + std::sqrt(front_m * front_m + 2.0 * minTurningRadius_m() * width_m);
  }
};

}  // namespace vcharge
