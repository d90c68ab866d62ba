#include "surface_shader.h"

#include <algorithm>
#include <cmath>

namespace vcharge {

namespace {

constexpr float kDetailContrast = 0.75F;

// Reflections see trees and houses, not sky, below this elevation (its sine).
constexpr float kSkylineSine = 0.22F;
constexpr float kSkylineLight = 0.10F;

}  // namespace

float SurfaceShader::ambient(const Eigen::Vector3f& normal) const {
  const float up = 0.5F + 0.5F * normal.z();
  return static_cast<float>(sky_.light().sky_irradiance) * up +
         static_cast<float>(sky_.light().bounce_irradiance) * (1.0F - up);
}

float SurfaceShader::groundAlbedo(int layer, float x_m, float y_m, float footprint_m, float stretch) const {
  // The four samples of a pixel lie in four rows and columns: along a stretched footprint they are taps a
  // quarter of the pixel apart, so that only the part between them has to be averaged by the pyramid.
  const float width_m = std::max(footprint_m * 0.6F * std::sqrt(stretch), footprint_m * 0.2F * stretch);
  const GroundTexture& texture = scene_.ground.layers[static_cast<size_t>(layer)];
  const float level = fastLog2(width_m * texture.texels_per_m);
  float albedo = kGroundLayerAlbedo * texture.sampleAt(x_m, y_m, level);
  for (const GroundTexture& detail : scene_.ground.details) {
    const float detail_level = fastLog2(width_m * detail.texels_per_m);
    if (detail_level < 4.0F) {
      albedo *= 1.0F + kDetailContrast * (detail.sampleAt(x_m, y_m, detail_level) - 0.5F);
    }
  }
  return albedo;
}

float SurfaceShader::shade(const SurfacePoint& point, float sun_visibility) const {
  const MeshTriangle& triangle = scene_.mesh.triangles[point.triangle];
  const Material& material = scene_.materials[triangle.material];
  const float sun = static_cast<float>(sky_.light().sun_irradiance);
  if (material.mapping == Material::Mapping::kGround) {
    const float x = point.position.x();
    const float y = point.position.y();
    const float stretch = 1.0F / std::max(0.02F, std::abs(point.direction.z()));
    const float albedo = groundAlbedo(material.texture, x, y, point.footprint_m, stretch);
    float surrounding = 1.0F;
    if (scene_.ground.sun != nullptr) {
      const float width_m = point.footprint_m * std::sqrt(stretch);
      const float level = fastLog2(width_m * scene_.ground.sun->texels_per_m);
      sun_visibility *= scene_.ground.sun->sampleAt(x, y, level);
      surrounding = scene_.ground.surrounding->sampleAt(x, y, 0.0F);
    }
    return albedo * (sun * sky_.directionToSun().z() * sun_visibility +
                     static_cast<float>(sky_.light().sky_irradiance) * surrounding);
  }
  const MeshVertex& a = scene_.mesh.vertices[triangle.vertices[0]];
  const MeshVertex& b = scene_.mesh.vertices[triangle.vertices[1]];
  const MeshVertex& c = scene_.mesh.vertices[triangle.vertices[2]];
  const float wa = 1.0F - point.u - point.v;
  Eigen::Vector3f normal = (wa * a.normal + point.u * b.normal + point.v * c.normal).normalized();
  const float towards = point.direction.dot(normal);
  if (towards > 0.0F && material.two_sided) {
    normal = -normal;
  }
  float albedo = material.albedo;
  if (material.mapping == Material::Mapping::kTexture) {
    const Texture& texture = scene_.textures[static_cast<size_t>(material.texture)];
    const float u = wa * a.u + point.u * b.u + point.v * c.u;
    const float v = wa * a.v + point.u * b.v + point.v * c.v;
    const float stretch = 1.0F / std::max(0.05F, std::abs(towards));
    const float level = fastLog2(0.6F * point.footprint_m * std::sqrt(stretch) * material.texels_per_m);
    albedo *= texture.sample(u * static_cast<float>(texture.width()),
                             v * static_cast<float>(texture.height()), level);
  }
  const float occlusion = wa * a.ambient + point.u * b.ambient + point.v * c.ambient;
  const float to_sun = normal.dot(sky_.directionToSun());
  const float lit = std::max(to_sun, 0.0F) + material.translucency * std::max(-to_sun, 0.0F);
  float light = albedo * (sun * lit * sun_visibility + ambient(normal) * occlusion);
  if (material.reflectivity > 0.0F) {
    light += occlusion * reflection(material, point.position, normal, point.direction);
  }
  return light;
}

float SurfaceShader::reflection(const Material& material, const Eigen::Vector3f& position,
                                const Eigen::Vector3f& normal, const Eigen::Vector3f& direction) const {
  const float cosine = std::min(1.0F, std::max(0.0F, -normal.dot(direction)));
  const float m = 1.0F - cosine;
  const float fresnel = material.reflectivity + (1.0F - material.reflectivity) * m * m * m * m * m;
  const Eigen::Vector3f mirrored = direction - 2.0F * normal.dot(direction) * normal;
  return fresnel * surroundings(position, mirrored);
}

float SurfaceShader::surroundings(const Eigen::Vector3f& position, const Eigen::Vector3f& direction) const {
  if (direction.z() > 0.0F) {
    const float skyline = std::min(1.0F, std::max(0.0F, (direction.z() - kSkylineSine) * 12.0F));
    return kSkylineLight + skyline * (std::min(sky_.radiance(direction), 2.0F) - kSkylineLight);
  }
  if (position.z() <= 0.0F || direction.z() > -0.03F || scene_.ground.layers.empty()) {
    return kSkylineLight;
  }
  const float distance = position.z() / -direction.z();
  const float x = position.x() + distance * direction.x();
  const float y = position.y() + distance * direction.y();
  // Curved paint blurs what it mirrors.
  const GroundTexture& texture = scene_.ground.layers.front();
  const float level = fastLog2((0.04F + 0.05F * distance) * texture.texels_per_m);
  const float albedo = kGroundLayerAlbedo * texture.sampleAt(x, y, level);
  const float sun = scene_.ground.sun == nullptr ? 1.0F : scene_.ground.sun->sampleAt(x, y, 1.0F);
  return albedo * (static_cast<float>(sky_.light().sun_irradiance) * sky_.directionToSun().z() * sun +
                   static_cast<float>(sky_.light().sky_irradiance));
}

float SurfaceShader::shadePlain(const Material& material, const Eigen::Vector3f& position,
                                const Eigen::Vector3f& normal, const Eigen::Vector3f& direction) const {
  const float to_sun = std::max(0.0F, normal.dot(sky_.directionToSun()));
  const float diffuse =
      material.albedo * (static_cast<float>(sky_.light().sun_irradiance) * to_sun + ambient(normal));
  return material.reflectivity > 0.0F ? diffuse + reflection(material, position, normal, direction) : diffuse;
}

}  // namespace vcharge
