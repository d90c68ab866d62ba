#pragma once

#include <array>

#include <Eigen/Core>

#include "vcharge_simulation/scenes/scene.h"

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
  /// `moving`: triangles that count on after those of the scene's mesh.
  SurfaceShader(const Scene& scene, const TriangleMesh& moving)
      : scene_(scene),
        moving_(moving),
        num_fixed_triangles_(static_cast<uint32_t>(scene.mesh.triangles.size())),
        sky_(*scene.sky) {}

  const Material& materialOf(uint32_t triangle) const { return scene_.materials[materialIndexOf(triangle)]; }
  uint32_t materialIndexOf(uint32_t triangle) const { return triangleOf(triangle).material; }
  /// True when the sun's visibility of this surface is baked into a light map.
  static bool hasBakedSun(const Material& material) {
    return material.mapping == Material::Mapping::kGround || material.sun_map >= 0;
  }

  /// sun_visibility: 0 in shadow, 1 in the sun (times the light map where there is one).
  float shade(const SurfacePoint& point, float sun_visibility) const;
  /// Mean light of a pixel whose four samples all meet the same triangle: its light is found once.
  float shadePixel(const std::array<SurfacePoint, 4>& points, float sun_visibility) const;
  /// Mean light of a pixel whose four samples (of CameraView's rotated grid) all meet one ground material at
  /// `positions`, about `direction`; `normal` is the ground's, unit.
  float shadeGroundPixel(const Material& material, const std::array<Eigen::Vector3f, 4>& positions,
                         const Eigen::Vector3f& normal, const Eigen::Vector3f& direction, float footprint_m,
                         float sun_visibility) const;
  /// Light of the sky, or of the ground where the direction points down; for reflections.
  float surroundings(const Eigen::Vector3f& position, const Eigen::Vector3f& direction) const;
  /// Light of a plain surface (the own car) in the world frame.
  float shadePlain(const Material& material, const Eigen::Vector3f& position, const Eigen::Vector3f& normal,
                   const Eigen::Vector3f& direction) const;
  float skyRadiance(const Eigen::Vector3f& direction) const { return sky_.radiance(direction); }

 private:
  struct Interpolated {
    Eigen::Vector3f normal;  ///< of the surface, turned to the viewer where the material is two-sided
    float towards;           ///< cosine between the ray and the normal before it was turned
    float u, v;              ///< texture coordinates
    float occlusion;         ///< share of the surroundings' light
  };
  const TriangleMesh& meshOf(uint32_t triangle) const {
    return triangle < num_fixed_triangles_ ? scene_.mesh : moving_;
  }
  const MeshTriangle& triangleOf(uint32_t triangle) const {
    return triangle < num_fixed_triangles_ ? scene_.mesh.triangles[triangle]
                                           : moving_.triangles[triangle - num_fixed_triangles_];
  }
  Interpolated interpolate(const SurfacePoint& point) const;
  float albedoAt(const SurfacePoint& point, const Interpolated& surface) const;
  float meanAlbedo(const std::array<SurfacePoint, 4>& points, const Interpolated& first) const;
  static float textureLevel(const Material& material, const SurfacePoint& point, const Interpolated& surface);
  float sunMapAt(const SurfacePoint& point, const Interpolated& surface) const;
  float lightOf(const SurfacePoint& point, const Interpolated& surface, float albedo,
                float sun_visibility) const;
  float detailFactor(const Eigen::Vector3f& position, float width_m) const;
  /// Cosine of the sun's light on the ground.
  float towardsSun(const Eigen::Vector3f& ground_normal) const;
  /// sun_share: of the sun's light, by its angle and what no light map knows.
  float groundLight(const Eigen::Vector3f& position, float width_m, float sun_share) const;
  float ambient(const Eigen::Vector3f& normal) const;
  float groundReflection(const Material& material, const Eigen::Vector3f& position,
                         const Eigen::Vector3f& direction) const;
  float ceilingRadiance(const Eigen::Vector3f& position, const Eigen::Vector3f& direction) const;
  float reflection(const Material& material, const Eigen::Vector3f& position, const Eigen::Vector3f& normal,
                   const Eigen::Vector3f& direction) const;

  const Scene& scene_;
  const TriangleMesh& moving_;
  const uint32_t num_fixed_triangles_;
  const Sky& sky_;
};

}  // namespace vcharge
