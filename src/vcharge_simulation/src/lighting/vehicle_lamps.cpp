#include "lighting/vehicle_lamps.h"

#include <algorithm>
#include <cmath>

namespace vcharge {

namespace {

constexpr float kBeamWidth_rad = 0.45F;   // to the side where it is 1/e as bright
constexpr float kBeamHeight_rad = 0.16F;  // below the brightest direction, likewise
constexpr float kBrightest_rad = -0.02F;
constexpr float kCutOff_rad = -0.004F;
constexpr float kAboveCutOff = 0.015F;
constexpr float kNearest_m = 0.2F;

float lowBeam(const Eigen::Vector3f& direction) {
  const float elevation = std::asin(std::clamp(direction.z(), -1.0F, 1.0F));
  const float side = std::atan2(direction.y(), direction.x()) / kBeamWidth_rad;
  float vertical = std::exp((elevation - kBrightest_rad) / kBeamHeight_rad);
  if (elevation > kBrightest_rad) {
    vertical = std::max(kAboveCutOff, (kCutOff_rad - elevation) / (kCutOff_rad - kBrightest_rad));
  }
  return vertical * std::exp(-side * side);
}

}  // namespace

float vehicleLampIrradiance(const VehicleLamps& lamps, const VehicleLamp& lamp,
                            const Eigen::Vector3f& point) {
  const Eigen::Vector3f offset = point - lamp.position;
  const float distance = std::max(kNearest_m, offset.norm());
  const Eigen::Vector3f direction = offset / distance;
  if ((direction.x() > 0.0F) == lamp.is_rear) {
    return 0.0F;
  }
  const float intensity =
      lamp.is_rear ? lamps.taillight * direction.x() * direction.x() : lamps.headlight * lowBeam(direction);
  return intensity / (distance * distance);
}

}  // namespace vcharge
