#include "vcharge_core/motion/vehicle_rates.h"

#include <cmath>

namespace vcharge {

RigidTransform arcMotion(double distance_m, double turn_rad) {
  // x = d sin(a) / a, y = d (1 - cos(a)) / a = d sin(a/2)^2 / (a/2)
  const double half = 0.5 * turn_rad;
  const double sinc_half = std::abs(half) < 1e-6 ? 1.0 - half * half / 6.0 : std::sin(half) / half;
  return RigidTransform::planar(distance_m * sinc_half * std::cos(half),
                                distance_m * sinc_half * std::sin(half), turn_rad);
}

VehicleRates VehicleRates::between(const RigidTransform& before_from_after, double time_s) {
  const double turn_rad = yawOfRotation(before_from_after.rotation());
  const double half = 0.5 * turn_rad;
  const double sinc_half = std::abs(half) < 1e-6 ? 1.0 : std::sin(half) / half;
  // The chord points along half of the turn.
  const Eigen::Vector2d along(std::cos(half), std::sin(half));
  return {along.dot(before_from_after.translation().head<2>()) / (sinc_half * time_s), turn_rad / time_s};
}

}  // namespace vcharge
