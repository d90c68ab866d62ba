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

}  // namespace vcharge
