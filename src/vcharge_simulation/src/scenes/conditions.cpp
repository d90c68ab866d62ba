#include "vcharge_simulation/scenes/conditions.h"

#include <algorithm>

namespace vcharge {

namespace {

// A sky lights the ground with `sky_lx`; everything that only the sky lights scales with it.
LightOptions lightOfSky(double sky_lx, double cloud_cover) {
  LightOptions light;
  const double noon = light.sky_irradiance;
  light.sky_irradiance = sky_lx / kSunIlluminance_lx;
  light.bounce_irradiance = 0.15 * light.sky_irradiance;
  light.skyline_light *= light.sky_irradiance / noon;
  light.sun_irradiance = 0.0;
  light.cloud_cover = cloud_cover;
  return light;
}

}  // namespace

Conditions conditionsOf(const ConditionOptions& options, const LightOptions& light_of_day) {
  Conditions conditions;
  conditions.light = light_of_day;
  conditions.wetness = options.kind == ConditionKind::kWet ? 1.0 : options.wetness;
  LightOptions& light = conditions.light;
  switch (options.kind) {
    case ConditionKind::kNoon:
      return conditions;
    case ConditionKind::kLowSun:
      light = lightOfSky(12e3, 0.25);
      light.sun_irradiance = 0.45;  // the long way through the air takes more than half
      light.sun_azimuth_rad = options.sun_azimuth_rad;
      light.sun_elevation_rad = options.sun_elevation_rad;
      return conditions;
    case ConditionKind::kOvercast:
    case ConditionKind::kWet:
      light = lightOfSky(15e3, 1.0);
      light.sun_glow = 0.0;
      return conditions;
    case ConditionKind::kDusk:
      light = lightOfSky(150.0, 0.4);
      light.sun_azimuth_rad = options.sun_azimuth_rad;
      light.sun_elevation_rad = -0.07;
      break;
    case ConditionKind::kNight:
      light = lightOfSky(0.3, 0.8);  // clouds over a lit town
      light.sun_glow = 0.0;
      break;
  }
  conditions.is_dark = true;
  conditions.pole_lamp_cd = 4000.0;
  conditions.headlight_cd = 20e3;
  conditions.taillight_cd = 15.0;
  return conditions;
}

VehicleLamps vehicleLampsOf(const Conditions& conditions, double illuminance_lx) {
  return {static_cast<float>(conditions.headlight_cd / illuminance_lx),
          static_cast<float>(conditions.taillight_cd / illuminance_lx)};
}

}  // namespace vcharge
