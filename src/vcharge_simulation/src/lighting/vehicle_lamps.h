#pragma once

#include <array>

#include <Eigen/Core>

#include "vcharge_simulation/scenes/scene.h"

namespace vcharge {

/// Headlights (low beam) and rear lamps of the own car, in the vehicle frame.
struct VehicleLamp {
  Eigen::Vector3f position;
  bool is_rear;
};
inline const std::array<VehicleLamp, 4> kVehicleLamps = {{{{3.46F, 0.62F, 0.65F}, false},
                                                          {{3.46F, -0.62F, 0.65F}, false},
                                                          {{-0.74F, 0.62F, 0.85F}, true},
                                                          {{-0.74F, -0.62F, 0.85F}, true}}};

/// Irradiance at a point of the vehicle frame on a surface that faces the lamp, if nothing is between. It
/// falls with the square of the distance. A low beam is brightest just below its cut-off, slightly below the
/// horizon.
float vehicleLampIrradiance(const VehicleLamps& lamps, const VehicleLamp& lamp, const Eigen::Vector3f& point);

}  // namespace vcharge
