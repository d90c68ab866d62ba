#include "rendering/surface_shader.h"

#include <algorithm>
#include <cmath>

#include "lighting/lamp_light.h"

namespace vcharge {

namespace {

// Coarser levels of the detail textures are uniform.
constexpr float kMaxDetailLevel = 4.0F;

// Sine of the elevation below which reflections show trees and houses instead of the sky.
constexpr float kSkylineSine = 0.22F;
// Additional reflectivity of a rough polish at grazing incidence.
constexpr float kGrazingGloss = 4.0F;
constexpr float kFlattestReliefRay = 0.15F;   // sine of the least elevation of a ray to the ground's relief
constexpr float kFlattestCeilingRay = 0.12F;  // sine of the least elevation of a ray to the ceiling

// Aspect ratio of the footprint of a round cone of rays on level ground.
float stretchOf(const Eigen::Vector3f& direction) {
  return 1.0F / std::max(0.02F, std::abs(direction.z()));
}

// The first and the last sample of a pixel are opposite each other about its centre.
SurfacePoint middleOf(const std::array<SurfacePoint, 4>& points) {
  SurfacePoint middle = points[0];
  middle.position = 0.5F * (points[0].position + points[3].position);
  middle.direction = 0.5F * (points[0].direction + points[3].direction);  // unit length to within 1e-6
  middle.u = 0.5F * (points[0].u + points[3].u);
  middle.v = 0.5F * (points[0].v + points[3].v);
  return middle;
}

// The four samples of a pixel lie in four rows and columns. Along a stretched footprint they are a quarter of
// the pixel apart, so the pyramid only has to average over that distance.
float groundSampleWidth(float footprint_m, float stretch) {
  return std::max(footprint_m * 0.6F * std::sqrt(stretch), footprint_m * 0.2F * stretch);
}

}  // namespace

float SurfaceShader::ambient(const Eigen::Vector3f& normal) const {
  const float up = 0.5F + 0.5F * normal.z();
  return static_cast<float>(sky_.light().sky_irradiance) * up +
         static_cast<float>(sky_.light().bounce_irradiance) * (1.0F - up);
}

float SurfaceShader::detailFactor(const Eigen::Vector3f& position, float width_m) const {
  float factor = 1.0F;
  for (const GroundTexture& detail : scene_.ground.details) {
    const float level = fastLog2(width_m * detail.texels_per_m);
    if (level < kMaxDetailLevel) {
      factor *=
          1.0F + scene_.ground.detail_contrast * (detail.sampleAt(position.x(), position.y(), level) - 0.5F);
    }
  }
  return factor;
}

Eigen::Vector3f SurfaceShader::reliefShift(const Eigen::Vector3f& position, const Eigen::Vector3f& direction,
                                           float width_m) const {
  const GroundLayers& ground = scene_.ground;
  if (ground.relief_m == 0.0F) {
    return Eigen::Vector3f::Zero();
  }
  const GroundTexture& relief = ground.details.front();
  const float level = fastLog2(width_m * relief.texels_per_m);
  if (level >= kMaxDetailLevel) {
    return Eigen::Vector3f::Zero();
  }
  const float height_m = ground.relief_m * (relief.sampleAt(position.x(), position.y(), level) - 0.5F);
  const float run = height_m / std::min(-kFlattestReliefRay, -std::abs(direction.z()));
  return {run * direction.x(), run * direction.y(), 0.0F};
}

float SurfaceShader::towardsSun(const Eigen::Vector3f& ground_normal) const {
  const float up = ground_normal.z() < 0.0F ? -1.0F : 1.0F;
  return std::max(0.0F, up * ground_normal.dot(sky_.directionToSun()));
}

float SurfaceShader::groundLight(const Eigen::Vector3f& position, float width_m, float sun_fraction) const {
  float surrounding = 1.0F;
  if (scene_.ground.sun != nullptr) {
    const float level = fastLog2(width_m * scene_.ground.sun->texels_per_m);
    sun_fraction *= scene_.ground.sun->sampleAt(position.x(), position.y(), level);
  }
  if (scene_.ground.surrounding != nullptr) {
    surrounding = scene_.ground.surrounding->sampleAt(position.x(), position.y(), 0.0F);
  }
  float light = static_cast<float>(sky_.light().sun_irradiance) * sun_fraction +
                static_cast<float>(sky_.light().sky_irradiance) * surrounding;
  if (scene_.ground.lamps != nullptr) {
    const float root = scene_.ground.lamps->sampleAt(position.x(), position.y(), 0.0F);
    light += scene_.ground.max_lamp_irradiance * root * root;
  }
  return light;
}

float SurfaceShader::lampLight(const Eigen::Vector3f& position, const Eigen::Vector3f& normal) const {
  float sum = 0.0F;
  for (const Lamp& lamp : scene_.lamps) {
    const Eigen::Vector3f to_lamp = lamp.centre - position;
    if (to_lamp.squaredNorm() < lamp.reach_m * lamp.reach_m) {
      sum += lampIrradiance(lamp, to_lamp, normal);
    }
  }
  return sum;
}

float SurfaceShader::shadeGroundPixel(const Material& material, const std::array<Eigen::Vector3f, 4>& samples,
                                      const Eigen::Vector3f& normal, const Eigen::Vector3f& direction,
                                      float footprint_m, const TracedLight& traced) const {
  const float stretch = stretchOf(direction);
  std::array<Eigen::Vector3f, 4> positions = samples;
  const Eigen::Vector3f shift =
      reliefShift(0.5F * (samples[0] + samples[3]), direction, footprint_m * std::sqrt(stretch));
  for (Eigen::Vector3f& position : positions) {
    position += shift;
  }
  const GroundTexture& texture = scene_.ground.layers[static_cast<size_t>(material.texture)];
  const float level = fastLog2(groundSampleWidth(footprint_m, stretch) * texture.texels_per_m);
  const float albedo = texture.sampleMeanAt(positions, level);
  // Fine details are sampled at the centres of two halves of the pixel, split across its longer side.
  const Eigen::Vector3f upper = 0.5F * (positions[0] + positions[1]);
  const Eigen::Vector3f lower = 0.5F * (positions[2] + positions[3]);
  const Eigen::Vector3f left = 0.5F * (positions[0] + positions[2]);
  const Eigen::Vector3f right = 0.5F * (positions[1] + positions[3]);
  const bool tall = (upper - lower).squaredNorm() > (left - right).squaredNorm();
  const float width_m = footprint_m * std::max(0.8F * std::sqrt(stretch), 0.4F * stretch);
  const float detail =
      0.5F * (detailFactor(tall ? upper : left, width_m) + detailFactor(tall ? lower : right, width_m));
  const Eigen::Vector3f middle = 0.5F * (upper + lower);
  return kGroundLayerAlbedo * albedo * detail *
             (groundLight(middle, footprint_m * std::sqrt(stretch),
                          traced.sun_visibility * towardsSun(normal)) +
              vehicleLightOnGround(normal, traced)) +
         groundReflection(material, middle, direction);
}

float SurfaceShader::groundReflection(const Material& material, const Eigen::Vector3f& position,
                                      const Eigen::Vector3f& direction) const {
  if (material.reflectivity <= 0.0F) {
    return 0.0F;
  }
  // A rough polish reflects grazing rays better than steep ones, but far less than glass does.
  const float m = 1.0F + std::min(0.0F, direction.z());
  const float reflected = material.reflectivity * (1.0F + kGrazingGloss * m * m * m * m * m);
  return reflected * surroundings(position, {direction.x(), direction.y(), -direction.z()});
}

float SurfaceShader::shade(const SurfacePoint& point, const TracedLight& traced) const {
  const Material& material = materialOf(point.triangle);
  if (material.mapping == Material::Mapping::kGround) {
    const float stretch = stretchOf(point.direction);
    const GroundTexture& texture = scene_.ground.layers[static_cast<size_t>(material.texture)];
    const float width_m = groundSampleWidth(point.footprint_m, stretch);
    const Eigen::Vector3f seen = point.position + reliefShift(point.position, point.direction, width_m);
    const float albedo = kGroundLayerAlbedo *
                         texture.sampleAt(seen.x(), seen.y(), fastLog2(width_m * texture.texels_per_m)) *
                         detailFactor(seen, width_m);
    const Eigen::Vector3f normal = point.geometric_normal.normalized();
    return albedo * (groundLight(point.position, point.footprint_m * std::sqrt(stretch),
                                 traced.sun_visibility * towardsSun(normal)) +
                     vehicleLightOnGround(normal, traced)) +
           groundReflection(material, point.position, point.direction);
  }
  const Interpolated surface = interpolate(point);
  return lightOf(point, surface, albedoAt(point, surface), traced);
}

float SurfaceShader::shadePixel(const std::array<SurfacePoint, 4>& points, const TracedLight& traced) const {
  const Material& material = materialOf(points[0].triangle);
  if (material.mapping == Material::Mapping::kGround) {
    return shadeGroundPixel(
        material, {points[0].position, points[1].position, points[2].position, points[3].position},
        points[0].geometric_normal.normalized(), 0.5F * (points[0].direction + points[3].direction),
        points[0].footprint_m, traced);
  }
  // Light is evaluated at the centre of the pixel, consistent with the mean of the texture.
  const SurfacePoint middle = middleOf(points);
  const Interpolated surface = interpolate(middle);
  const float albedo =
      material.mapping == Material::Mapping::kTexture ? meanAlbedo(points, surface) : material.albedo;
  return lightOf(middle, surface, albedo, traced);
}

SurfaceShader::Interpolated SurfaceShader::interpolate(const SurfacePoint& point) const {
  const MeshTriangle& triangle = triangleOf(point.triangle);
  const std::vector<MeshVertex>& vertices = meshOf(point.triangle).vertices;
  const MeshVertex& a = vertices[triangle.vertices[0]];
  const MeshVertex& b = vertices[triangle.vertices[1]];
  const MeshVertex& c = vertices[triangle.vertices[2]];
  const float wa = 1.0F - point.u - point.v;
  Interpolated surface;
  surface.normal = (wa * a.normal + point.u * b.normal + point.v * c.normal).normalized();
  surface.towards = point.direction.dot(surface.normal);
  if (surface.towards > 0.0F && scene_.materials[triangle.material].two_sided) {
    surface.normal = -surface.normal;
  }
  surface.u = wa * a.u + point.u * b.u + point.v * c.u;
  surface.v = wa * a.v + point.u * b.v + point.v * c.v;
  surface.occlusion = wa * a.ambient + point.u * b.ambient + point.v * c.ambient;
  return surface;
}

float SurfaceShader::albedoAt(const SurfacePoint& point, const Interpolated& surface) const {
  const Material& material = materialOf(point.triangle);
  if (material.mapping != Material::Mapping::kTexture) {
    return material.albedo;
  }
  const Texture& texture = scene_.textures[static_cast<size_t>(material.texture)];
  return material.albedo * texture.sample(surface.u * static_cast<float>(texture.width()),
                                          surface.v * static_cast<float>(texture.height()),
                                          textureLevel(material, point, surface));
}

float SurfaceShader::meanAlbedo(const std::array<SurfacePoint, 4>& points, const Interpolated& first) const {
  const MeshTriangle& triangle = triangleOf(points[0].triangle);
  const std::vector<MeshVertex>& vertices = meshOf(points[0].triangle).vertices;
  const MeshVertex& a = vertices[triangle.vertices[0]];
  const MeshVertex& b = vertices[triangle.vertices[1]];
  const MeshVertex& c = vertices[triangle.vertices[2]];
  const Material& material = scene_.materials[triangle.material];
  const Texture& texture = scene_.textures[static_cast<size_t>(material.texture)];
  const auto width = static_cast<float>(texture.width());
  const auto height = static_cast<float>(texture.height());
  std::array<float, 4> x;
  std::array<float, 4> y;
  for (size_t i = 0; i < 4; ++i) {
    const float wa = 1.0F - points[i].u - points[i].v;
    x[i] = width * (wa * a.u + points[i].u * b.u + points[i].v * c.u);
    y[i] = height * (wa * a.v + points[i].u * b.v + points[i].v * c.v);
  }
  return material.albedo * texture.sampleMean(x, y, textureLevel(material, points[0], first));
}

float SurfaceShader::textureLevel(const Material& material, const SurfacePoint& point,
                                  const Interpolated& surface) {
  const float stretch = 1.0F / std::max(0.05F, std::abs(surface.towards));
  return fastLog2(0.6F * point.footprint_m * std::sqrt(stretch) * material.texels_per_m);
}

float SurfaceShader::sunMapAt(const SurfacePoint& point, const Interpolated& surface) const {
  const Material& material = materialOf(point.triangle);
  if (material.sun_map < 0) {
    return 1.0F;
  }
  const Texture& map = scene_.textures[static_cast<size_t>(material.sun_map)];
  const float stretch = 1.0F / std::max(0.05F, std::abs(surface.towards));
  const float level = fastLog2(point.footprint_m * std::sqrt(stretch) * material.sun_map_texels_per_m);
  return map.sample(surface.u * static_cast<float>(map.width()), surface.v * static_cast<float>(map.height()),
                    level);
}

float SurfaceShader::lightOf(const SurfacePoint& point, const Interpolated& surface, float albedo,
                             const TracedLight& traced) const {
  const Material& material = materialOf(point.triangle);
  const auto sun = static_cast<float>(sky_.light().sun_irradiance);
  const float to_sun = surface.normal.dot(sky_.directionToSun());
  const float lit = std::max(to_sun, 0.0F) + material.translucency * std::max(-to_sun, 0.0F);
  const float sun_visibility = traced.sun_visibility * sunMapAt(point, surface);
  float light =
      material.emission + albedo * (sun * lit * sun_visibility + ambient(surface.normal) * surface.occlusion);
  const float from_vehicle = surface.normal.dot(traced.vehicle_lamps);
  light += albedo * (std::max(from_vehicle, 0.0F) + material.translucency * std::max(-from_vehicle, 0.0F));
  if (!scene_.lamps.empty()) {
    light += albedo * lampLight(point.position, surface.normal);
  }
  if (material.reflectivity <= 0.0F) {
    return light;
  }
  // Under a ceiling, the ambient value is the amount of light and not the visible part of the surroundings.
  const float seen = scene_.ceiling != nullptr ? 1.0F : surface.occlusion;
  return light + seen * reflection(material, point.position, surface.normal, point.direction);
}

float SurfaceShader::fresnel(const Material& material, const Eigen::Vector3f& normal,
                             const Eigen::Vector3f& direction) {
  const float cosine = std::min(1.0F, std::max(0.0F, -normal.dot(direction)));
  const float m = 1.0F - cosine;
  return material.reflectivity + (1.0F - material.reflectivity) * m * m * m * m * m;
}

float SurfaceShader::reflection(const Material& material, const Eigen::Vector3f& position,
                                const Eigen::Vector3f& normal, const Eigen::Vector3f& direction) const {
  const Eigen::Vector3f mirrored = direction - 2.0F * normal.dot(direction) * normal;
  return fresnel(material, normal, direction) * surroundings(position, mirrored);
}

float SurfaceShader::ceilingRadiance(const Eigen::Vector3f& position,
                                     const Eigen::Vector3f& direction) const {
  // Flatter rays meet a wall before the ceiling.
  const float distance =
      (scene_.ceiling->height_m - position.z()) / std::max(direction.z(), kFlattestCeilingRay);
  // Imperfect polish blurs the reflection with distance.
  const float level = fastLog2((0.1F + 0.06F * distance) * scene_.ceiling->radiance.texels_per_m);
  return scene_.ceiling->scale * scene_.ceiling->radiance.sampleAt(position.x() + distance * direction.x(),
                                                                   position.y() + distance * direction.y(),
                                                                   level);
}

float SurfaceShader::surroundings(const Eigen::Vector3f& position, const Eigen::Vector3f& direction) const {
  if (direction.z() > 0.0F && scene_.ceiling != nullptr) {
    return ceilingRadiance(position, direction);
  }
  if (direction.z() > 0.0F) {
    const auto skyline_light = static_cast<float>(sky_.light().skyline_light);
    const float skyline = std::min(1.0F, std::max(0.0F, (direction.z() - kSkylineSine) * 12.0F));
    return skyline_light + skyline * (std::min(sky_.radiance(direction), 2.0F) - skyline_light);
  }
  if (position.z() <= 0.0F || direction.z() > -0.03F || scene_.ground.layers.empty()) {
    return static_cast<float>(sky_.light().skyline_light);
  }
  const float distance = position.z() / -direction.z();
  const float x = position.x() + distance * direction.x();
  const float y = position.y() + distance * direction.y();
  // Curved paint blurs the reflection.
  const GroundTexture& texture = scene_.ground.layers.front();
  const float level = fastLog2((0.04F + 0.05F * distance) * texture.texels_per_m);
  const float albedo = kGroundLayerAlbedo * texture.sampleAt(x, y, level);
  if (scene_.ceiling != nullptr) {
    return albedo * groundLight({x, y, 0.0F}, 0.1F, 0.0F);
  }
  const float sun = scene_.ground.sun == nullptr ? 1.0F : scene_.ground.sun->sampleAt(x, y, 1.0F);
  return albedo * (static_cast<float>(sky_.light().sun_irradiance) * sky_.directionToSun().z() * sun +
                   static_cast<float>(sky_.light().sky_irradiance));
}

float SurfaceShader::shadePlain(const Material& material, const Eigen::Vector3f& position,
                                const Eigen::Vector3f& normal, const Eigen::Vector3f& direction) const {
  const float matt = shadeMatt(material, position, normal);
  return material.reflectivity > 0.0F ? matt + reflection(material, position, normal, direction) : matt;
}

float SurfaceShader::shadeMatt(const Material& material, const Eigen::Vector3f& position,
                               const Eigen::Vector3f& normal) const {
  const float to_sun = std::max(0.0F, normal.dot(sky_.directionToSun()));
  const float lamps = scene_.lamps.empty() ? 0.0F : lampLight(position, normal);
  // Under a ceiling, the baked light of the floor gives the local brightness.
  const float surrounding = scene_.ceiling != nullptr ? groundLight(position, 0.5F, 0.0F) : ambient(normal);
  return material.albedo * (static_cast<float>(sky_.light().sun_irradiance) * to_sun + surrounding + lamps);
}

}  // namespace vcharge
