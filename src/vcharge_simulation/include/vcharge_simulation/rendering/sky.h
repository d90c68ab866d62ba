#pragma once

#include <cstdint>

#include <Eigen/Core>

#include "vcharge_simulation/rendering/texture.h"

namespace vcharge {

/// Illuminance of a surface perpendicular to the sun at noon, to which light outdoors is relative.
inline constexpr double kSunIlluminance_lx = 1e5;

/// Sun, sky and ground light, relative to the sun's irradiance on a surface perpendicular to it.
struct LightOptions {
  double sun_azimuth_rad = 2.2;
  double sun_elevation_rad = 0.75;
  double sun_irradiance = 1.0;
  double sky_irradiance = 0.42;     ///< irradiance from the whole sky on level ground
  double bounce_irradiance = 0.12;  ///< irradiance from the ground on a surface that faces down
  double cloud_cover = 0.45;        ///< 0 clear, 1 overcast
  double skyline_light = 0.10;      ///< radiance of distant trees and houses in reflections
  double sun_glow = 1.0;            ///< brightness of the sky around the sun, relative to a clear sky's
};

/// Sky with a vertical gradient, a cloud layer in perspective, and a glow around the sun.
class Sky {
 public:
  Sky(const LightOptions& options, uint32_t seed);

  /// Radiance from a unit direction with z >= 0.
  float radiance(const Eigen::Vector3f& direction) const;
  const Eigen::Vector3f& directionToSun() const { return direction_to_sun_; }
  const LightOptions& light() const { return light_; }

 private:
  LightOptions light_;
  Eigen::Vector3f direction_to_sun_;
  Texture clouds_;
};

}  // namespace vcharge
