#pragma once

#include <Eigen/Core>

#include "vcharge_simulation/scene.h"

namespace vcharge {

/// Where a ray meets the scene.
struct SurfacePoint {
  Eigen::Vector3f position;
  Eigen::Vector3f direction;  ///< of the ray, unit
  Eigen::Vector3f geometric_normal;
  uint32_t triangle;
  float u, v;         ///< barycentric
  float footprint_m;  ///< width of the sample's cone
};

/// Light that leaves the scene's surfaces towards the viewer.
class SurfaceShader {
 public:
  explicit SurfaceShader(const Scene& scene) : scene_(scene), sky_(*scene.sky) {}

  const Material& materialOf(uint32_t triangle) const {
    return scene_.materials[scene_.mesh.triangles[triangle].material];
  }
  /// True when the sun's visibility of this surface is baked into the ground's light map.
  static bool hasBakedSun(const Material& material) { return material.mapping == Material::Mapping::kGround; }

  /// sun_visibility: 0 in shadow, 1 in the sun (times the light map for the ground).
  float shade(const SurfacePoint& point, float sun_visibility) const;
  /// Light of the sky, or of the ground where the direction points down; for reflections.
  float surroundings(const Eigen::Vector3f& position, const Eigen::Vector3f& direction) const;
  /// Light of a plain surface (the own car) in the world frame.
  float shadePlain(const Material& material, const Eigen::Vector3f& position, const Eigen::Vector3f& normal,
                   const Eigen::Vector3f& direction) const;
  float skyRadiance(const Eigen::Vector3f& direction) const { return sky_.radiance(direction); }

 private:
  float groundAlbedo(int layer, float x_m, float y_m, float footprint_m, float stretch) const;
  float ambient(const Eigen::Vector3f& normal) const;
  float reflection(const Material& material, const Eigen::Vector3f& position, const Eigen::Vector3f& normal,
                   const Eigen::Vector3f& direction) const;

  const Scene& scene_;
  const Sky& sky_;
};

}  // namespace vcharge
