#pragma once

#include <functional>
#include <vector>

#include "rendering/ray_tracer.h"
#include "vcharge_simulation/scenes/scene.h"

namespace vcharge {

/// A wall whose texture coordinates run from (0, 1) at `foot` to (1, 0) at `foot + along + up`.
struct Wall {
  Eigen::Vector3f foot, along, up;
  uint32_t material;
};

/// Gives the walls' materials a sun map: how much of the sun (a disk) reaches each place of them. Behind
/// leaves a few shadow rays per pixel would make a speckle that differs from view to view. Each wall needs a
/// material of its own.
void bakeWallLight(const std::vector<Wall>& walls, double texel_m, Scene* scene);

/// Fills scene->ground.sun and .surrounding: how much of the sun (a disk) and of the sky reaches each place
/// of the ground in [min_m, max_m], whose height is `ground_height(x, y)`. The same scene gives the same
/// maps.
void bakeGroundLight(const Eigen::Vector2d& min_m, const Eigen::Vector2d& max_m, double texel_m,
                     const std::function<double(double, double)>& ground_height, Scene* scene);

/// Sets the vertices' ambient to the share of a cosine-weighted hemisphere that is free, above ground at z =
/// 0.
void bakeVertexAmbient(int rays_per_vertex, TriangleMesh* mesh);

}  // namespace vcharge
