#pragma once

#include "vcharge_core/sparse_map/sparse_map.h"

namespace vcharge {

// Keyframes this close, and looking the same way, are at one place.
inline constexpr double kPlaceRadius_m = 1.0;
inline constexpr double kPlaceAngle_rad = 0.35;

inline bool isAtPlace(const MapKeyframe& a, const MapKeyframe& b) {
  const RigidTransform between = a.map_from_vehicle.inverse() * b.map_from_vehicle;
  return between.translation().norm() <= kPlaceRadius_m &&
         angleOfRotation(between.rotation()) <= kPlaceAngle_rad;
}

}  // namespace vcharge
