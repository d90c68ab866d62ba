#pragma once

#include <array>
#include <cmath>

#include <Eigen/Core>

#include "vcharge_simulation/scenes/scene.h"

namespace vcharge {

/// Intersection of a ray with the scene.
struct SurfacePoint {
  Eigen::Vector3f position;
  Eigen::Vector3f direction;  ///< unit direction of the ray
  Eigen::Vector3f geometric_normal;
  uint32_t triangle;
  float u, v;         ///< barycentric
  float footprint_m;  ///< width of the sample's cone at the surface
};

/// Direct light at a point that no light map holds.
struct TracedLight {
  float sun_visibility = 1.0F;  ///< 0 in shadow and 1 in the sun; multiplies the light map if there is one
  Eigen::Vector3f vehicle_lamps = Eigen::Vector3f::Zero();  ///< see SecondaryLight::vehicleLampsAt
};

/// Computes the light that leaves surfaces towards the viewer.
class SurfaceShader {
 public:
  /// Triangles of `moving` are numbered after those of the scene's mesh.
  SurfaceShader(const Scene& scene, const TriangleMesh& moving)
      : scene_(scene),
        moving_(moving),
        num_fixed_triangles_(static_cast<uint32_t>(scene.mesh.triangles.size())),
        sky_(*scene.sky) {}

  const Material& materialOf(uint32_t triangle) const { return scene_.materials[materialIndexOf(triangle)]; }
  uint32_t materialIndexOf(uint32_t triangle) const { return triangleOf(triangle).material; }
  /// True if a light map holds the visibility of the sun.
  static bool hasBakedSun(const Material& material) {
    return material.mapping == Material::Mapping::kGround || material.sun_map >= 0;
  }

  float shade(const SurfacePoint& point, const TracedLight& traced) const;
  /// Mean light of a pixel whose four samples meet the same triangle; evaluates the light only once.
  float shadePixel(const std::array<SurfacePoint, 4>& points, const TracedLight& traced) const;
  /// Mean light of a pixel whose four samples (see CameraView) meet one ground material at `samples`.
  /// `direction` is the mean ray, `normal` the unit normal of the ground.
  float shadeGroundPixel(const Material& material, const std::array<Eigen::Vector3f, 4>& samples,
                         const Eigen::Vector3f& normal, const Eigen::Vector3f& direction, float footprint_m,
                         const TracedLight& traced) const;
  /// Light from the sky, or from the ground for downward directions; for reflections.
  float surroundings(const Eigen::Vector3f& position, const Eigen::Vector3f& direction) const;
  /// Fraction of the light that a glossy surface reflects towards a ray's origin (Schlick).
  static float fresnel(const Material& material, const Eigen::Vector3f& normal,
                       const Eigen::Vector3f& direction);
  /// Diffuse light of an untextured surface (the own car) in the world frame.
  float shadeMatt(const Material& material, const Eigen::Vector3f& position,
                  const Eigen::Vector3f& normal) const;
  /// The same, with the reflection of surroundings().
  float shadePlain(const Material& material, const Eigen::Vector3f& position, const Eigen::Vector3f& normal,
                   const Eigen::Vector3f& direction) const;
  float skyRadiance(const Eigen::Vector3f& direction) const { return sky_.radiance(direction); }

 private:
  struct Interpolated {
    Eigen::Vector3f normal;  ///< turned towards the viewer if the material is two-sided
    float towards;           ///< cosine between the ray and the normal before it was turned
    float u, v;              ///< texture coordinates
    float occlusion;         ///< fraction of the ambient light
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
                const TracedLight& traced) const;
  /// Irradiance from the scene's lamps, without shadows.
  float lampLight(const Eigen::Vector3f& position, const Eigen::Vector3f& normal) const;
  float detailFactor(const Eigen::Vector3f& position, float width_m) const;
  /// From the point where a ray meets the flat ground to the point below which it meets the relief.
  Eigen::Vector3f reliefShift(const Eigen::Vector3f& position, const Eigen::Vector3f& direction,
                              float width_m) const;
  /// Cosine of the sun's incidence on the ground.
  float towardsSun(const Eigen::Vector3f& ground_normal) const;
  /// `sun_fraction` is the fraction of the sun's light left by the incidence angle and by shadows outside the
  /// light map.
  float groundLight(const Eigen::Vector3f& position, float width_m, float sun_fraction) const;
  /// Irradiance of ground with this unit normal from the own car's lamps.
  static float vehicleLightOnGround(const Eigen::Vector3f& normal, const TracedLight& traced) {
    return std::abs(normal.dot(traced.vehicle_lamps));
  }
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
