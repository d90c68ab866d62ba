#pragma once

#include <vector>

#include "rendering/ray_tracer.h"
#include "vcharge_simulation/scenes/scene.h"

namespace vcharge {

/// A fluorescent tube: it shines downwards, and a little upwards.
struct Lamp {
  Eigen::Vector3f centre;
  Eigen::Vector3f half_length;  ///< from the centre to one end
  float intensity = 1.0F;       ///< baked share at 1 m below the lamp
};

/// How lamps are baked. Light is in shares of the sky's irradiance.
struct LampOptions {
  double floor_texel_m = 0.1;
  int rays_per_lamp = 2;
  int gathered_rays = 24;        ///< of the light that comes back from floor and walls
  double floor_albedo = 0.22;    ///< mean
  double other_radiance = 0.07;  ///< of walls, ceiling and things, on average
};

/// Bakes the light of lamps into a closed scene whose light is all local: fills scene->ground.surrounding in
/// [min_m, max_m] at z = 0 and overwrites every vertex' ambient with the share there. The sky's
/// sky_irradiance and bounce_irradiance must be equal: what share 1 stands for, from wherever the light
/// comes. The same scene and lamps give the same light on any number of threads.
void bakeLampLight(const std::vector<Lamp>& lamps, const LampOptions& options, const Eigen::Vector2d& min_m,
                   const Eigen::Vector2d& max_m, Scene* scene);

}  // namespace vcharge
