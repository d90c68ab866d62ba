#pragma once

#include <functional>
#include <vector>

#include "rendering/ray_tracer.h"
#include "vcharge_simulation/scenes/scene.h"

namespace vcharge {

/// Fills ground.lamps with the light of scene->lamps, shadowed by the scene, in [min_m, max_m] at height
/// `ground_height(x, y)`. The same scene gives the same map for any number of threads.
void bakeGroundLamps(const Eigen::Vector2d& min_m, const Eigen::Vector2d& max_m, double texel_m,
                     const std::function<double(double, double)>& ground_height, Scene* scene);

/// Options of the lamp light. Light is relative to the sky's irradiance.
struct LampOptions {
  double floor_texel_m = 0.1;
  int rays_per_lamp = 2;
  int gathered_rays = 24;        ///< for indirect light from floor and walls
  double floor_albedo = 0.22;    ///< mean reflectance of the floor
  double other_radiance = 0.07;  ///< mean radiance of walls, ceiling and objects
};

/// Bakes the light of lamps into a closed scene: fills scene->ground.surrounding in [min_m, max_m] at z = 0
/// and sets the ambient light of every vertex. sky_irradiance and bounce_irradiance of the scene's sky must
/// be equal, since both are the irradiance at baked value 1. The same scene and lamps give the same light for
/// any number of threads.
void bakeLampLight(const std::vector<Lamp>& lamps, const LampOptions& options, const Eigen::Vector2d& min_m,
                   const Eigen::Vector2d& max_m, Scene* scene);

}  // namespace vcharge
