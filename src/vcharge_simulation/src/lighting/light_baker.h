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

/// Bakes a sun map for each wall's material: the fraction of the sun's disk visible from each point. Tracing
/// a few shadow rays per pixel behind leaves instead would give noise that differs between views. Each wall
/// needs its own material.
void bakeWallLight(const std::vector<Wall>& walls, double texel_m, Scene* scene);

/// A surface of the scene, flat or curved, with a material of its own.
struct LitSurface {
  struct Point {
    Eigen::Vector3f position;
    Eigen::Vector3f normal;  ///< unit, outwards
  };
  std::function<Point(float u, float v)> pointAt;  ///< at texture coordinates in [0, 1]
  Eigen::Vector2d size_m;                          ///< along u and v
  uint32_t material;
};
/// The same as bakeWallLight.
void bakeSunMaps(const std::vector<LitSurface>& surfaces, double texel_m, Scene* scene);
/// Sets the ambient light of the surfaces' vertices: sky where no surface of the scene hides it, and all of
/// the light from the ground.
void bakeSkyLight(const std::vector<LitSurface>& surfaces, int rays_per_vertex, Scene* scene);

/// Fills scene->ground.sun and .surrounding: the fraction of the sun's disk and of the sky visible from each
/// point of the ground in [min_m, max_m], at height `ground_height(x, y)`. The same scene gives the same
/// maps.
void bakeGroundLight(const Eigen::Vector2d& min_m, const Eigen::Vector2d& max_m, double texel_m,
                     const std::function<double(double, double)>& ground_height, Scene* scene);

/// Sets the ambient light of each vertex to the unoccluded fraction of its cosine-weighted hemisphere, above
/// ground at z = 0.
void bakeVertexAmbient(int rays_per_vertex, TriangleMesh* mesh);

}  // namespace vcharge
