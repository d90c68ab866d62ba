#pragma once

#include <string>
#include <vector>

#include "vcharge_core/base/options.h"
#include "vcharge_simulation/rendering/sky.h"
#include "vcharge_simulation/scenes/scene.h"

namespace vcharge {

/// Light and weather. Indoors the sky is not seen: dusk and night switch off every other lamp and the car's
/// headlights on, and wet is a wet floor.
enum class ConditionKind { kNoon, kLowSun, kOvercast, kDusk, kNight, kWet };

template <>
inline std::vector<std::string> enumNames<ConditionKind>() {
  return {"noon", "low_sun", "overcast", "dusk", "night", "wet"};
}

/// With the defaults a scene has the light of its day. Otherwise the cameras control their exposure.
struct ConditionOptions {
  VCHARGE_BEGIN_OPTIONS(ConditionOptions);
  VCHARGE_OPTION(ConditionKind, kind, ConditionKind::kNoon, anyValue(), "Light and weather.");
  VCHARGE_OPTION(double, sun_azimuth_rad, 0.15, between(-10.0, 10.0),
                 "Direction to the sun of low_sun and dusk from the x axis of the world.");
  VCHARGE_OPTION(double, sun_elevation_rad, 0.24, between(0.0, 1.57), "Elevation of the sun of low_sun.");
  VCHARGE_OPTION(double, wetness, 0.0, between(0.0, 1.0), "Water on the ground; at least 1 if kind is wet.");
  VCHARGE_END_OPTIONS();

  bool isNoon() const { return kind == ConditionKind::kNoon && wetness == 0.0; }
};

/// What a condition means physically.
struct Conditions {
  LightOptions light;  ///< outdoors
  double wetness = 0.0;
  bool is_dark = false;       ///< outdoors lamps are on; indoors every other lamp is off
  double pole_lamp_cd = 0.0;  ///< straight down
  double headlight_cd = 0.0;  ///< brightest direction of each of the own car's low beams
  double taillight_cd = 0.0;  ///< straight back, each
};

/// `light_of_day` is the light of the scene without conditions.
Conditions conditionsOf(const ConditionOptions& options, const LightOptions& light_of_day = LightOptions());

/// The own car's lamps in a scene where light 1 is `illuminance_lx`.
VehicleLamps vehicleLampsOf(const Conditions& conditions, double illuminance_lx);

}  // namespace vcharge
