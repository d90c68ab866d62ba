#pragma once

#include <functional>

#include "ray_tracer.h"
#include "vcharge_simulation/scene.h"

namespace vcharge {

/// Fills scene->ground.sun and .surrounding: how much of the sun (a disk) and of the sky reaches each place
/// of the ground in [min_m, max_m], whose height is `ground_height(x, y)`. The same scene gives the same
/// maps.
void bakeGroundLight(const Eigen::Vector2d& min_m, const Eigen::Vector2d& max_m, double texel_m,
                     const std::function<double(double, double)>& ground_height, Scene* scene);

/// Sets the vertices' ambient to the share of a cosine-weighted hemisphere that is free, above ground at z =
/// 0.
void bakeVertexAmbient(int rays_per_vertex, TriangleMesh* mesh);

}  // namespace vcharge
