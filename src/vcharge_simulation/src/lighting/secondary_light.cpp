#include "lighting/secondary_light.h"

#include <algorithm>
#include <limits>

#include "lighting/vehicle_lamps.h"
#include "lighting/wet_ground.h"

namespace vcharge {

namespace {

// Reflections in glossy paint of the own car.
constexpr float kBrightestReflection = 2.0F;
constexpr float kMirroredCone_rad = 0.01F;
constexpr float kWaterCone_rad = 0.004F;
// Lamps are not traced where they are darker than these fractions of a headlight at 1 m and of the sky.
constexpr float kFaintestOfHeadlight = 5e-6F;
constexpr float kFaintestOfSky = 0.002F;

}  // namespace

SecondaryLight::SecondaryLight(const Scene& scene, const SurfaceShader& shader, const CameraView& view)
    : scene_(scene),
      shader_(shader),
      view_(view),
      sun_(scene.sky->directionToSun()),
      has_sun_(scene.sky->light().sun_irradiance > 0.0),
      has_vehicle_lamps_(scene.vehicle_lamps.headlight > 0.0F || scene.vehicle_lamps.taillight > 0.0F),
      faintest_lamp_(std::max(kFaintestOfHeadlight * scene.vehicle_lamps.headlight,
                              kFaintestOfSky * static_cast<float>(scene.sky->light().sky_irradiance))) {}

bool SecondaryLight::isShadowed(const ExposedRow& row, const Eigen::Vector3f& position) const {
  return has_sun_ && (isShadowedByBody(row, position) || row.instant->isShadowedByMover(position, sun_));
}

bool SecondaryLight::isShadowedByBody(const ExposedRow& row, const Eigen::Vector3f& position) const {
  if (view_.body() == nullptr) {
    return false;
  }
  const Eigen::Vector3f in_vehicle = row.vehicle_rotation.transpose() * (position - row.vehicle_origin);
  // The shadow ray must pass within the body's radius.
  const float along = -in_vehicle.dot(row.sun_in_vehicle);
  const float radius = view_.body()->radius();
  if (along < -radius || (in_vehicle + along * row.sun_in_vehicle).squaredNorm() > radius * radius) {
    return false;
  }
  return view_.body()->tracer().occluded(in_vehicle + kShadowOffset_m * row.sun_in_vehicle,
                                         row.sun_in_vehicle, kMaxShadow_m);
}

Eigen::Vector3f SecondaryLight::vehicleLampsAt(const ExposedRow& row, const Eigen::Vector3f& position) const {
  Eigen::Vector3f sum = Eigen::Vector3f::Zero();
  const Eigen::Vector3f in_vehicle = row.vehicle_rotation.transpose() * (position - row.vehicle_origin);
  for (const VehicleLamp& lamp : kVehicleLamps) {
    const float irradiance = vehicleLampIrradiance(scene_.vehicle_lamps, lamp, in_vehicle);
    if (irradiance <= faintest_lamp_) {
      continue;
    }
    const Eigen::Vector3f offset = row.vehicle_origin + row.vehicle_rotation * lamp.position - position;
    const float distance = offset.norm();
    const Eigen::Vector3f to_lamp = offset / distance;
    if (!row.instant->occluded(position + kShadowOffset_m * to_lamp, to_lamp,
                               distance - 2.0F * kShadowOffset_m)) {
      sum += irradiance * to_lamp;
    }
  }
  return sum;
}

float SecondaryLight::shadeBody(const ExposedRow& row, const CameraView::BodySample& sample,
                                const Eigen::Vector3f& ray) const {
  const Material& material = view_.body()->materials()[sample.material];
  const Eigen::Vector3f position = row.vehicle_origin + row.vehicle_rotation * sample.position;
  const Eigen::Vector3f normal = row.vehicle_rotation * sample.normal;
  if (!view_.body()->isGlossy() || material.reflectivity <= 0.0F) {
    return shader_.shadePlain(material, position, normal, ray);
  }
  return shader_.shadeMatt(material, position, normal) +
         SurfaceShader::fresnel(material, normal, ray) *
             mirroredLight(row, position + kShadowOffset_m * normal, ray - 2.0F * normal.dot(ray) * normal,
                           kBrightestReflection, kMirroredCone_rad);
}

float SecondaryLight::wetted(const ExposedRow& row, float dry, float wetness, const Eigen::Vector3f& position,
                             const Eigen::Vector3f& normal, const Eigen::Vector3f& direction,
                             float footprint_m) const {
  const Eigen::Vector3f up = normal.z() < 0.0F ? Eigen::Vector3f(-normal) : normal;
  // Along the ray a pixel covers more of the ground.
  const float along_m = footprint_m / std::max(0.02F, std::abs(direction.dot(up)));
  const Water water = waterAt(position, up, wetness, along_m);
  const float reflected = water.mirror * waterReflectance(-direction.dot(water.normal));
  Eigen::Vector3f mirrored = direction - 2.0F * water.normal.dot(direction) * water.normal;
  // Ripples never send light below the horizon.
  mirrored.z() = std::max(mirrored.z(), 1e-3F);
  mirrored.normalize();
  const Eigen::Vector3f origin = position + kShadowOffset_m * up;
  float light = 0.0F;
  if (!meetsBody(row, origin, mirrored, &light)) {
    light = mirroredLight(row, origin, mirrored, std::numeric_limits<float>::infinity(), kWaterCone_rad);
  }
  return (1.0F - reflected) * water.darkening * dry + reflected * light;
}

bool SecondaryLight::meetsBody(const ExposedRow& row, const Eigen::Vector3f& origin,
                               const Eigen::Vector3f& direction, float* light) const {
  const VehicleBody* body = view_.body();
  if (body == nullptr || (origin - row.vehicle_origin).norm() > 2.0F * body->radius()) {
    return false;
  }
  RayTracer::Hit hit;
  const Eigen::Vector3f start = row.vehicle_rotation.transpose() * (origin - row.vehicle_origin);
  const Eigen::Vector3f towards = row.vehicle_rotation.transpose() * direction;
  if (!body->tracer().cast(start, towards, &hit)) {
    return false;
  }
  *light = shader_.shadePlain(body->materials()[body->mesh().triangles[hit.triangle].material],
                              origin + hit.distance_m * direction,
                              row.vehicle_rotation * hit.normal(body->mesh()), direction);
  return true;
}

// Light that reaches a mirroring surface from a direction.
float SecondaryLight::mirroredLight(const ExposedRow& row, const Eigen::Vector3f& origin,
                                    const Eigen::Vector3f& direction, float brightest, float cone_rad) const {
  RayTracer::Hit hit;
  if (!row.instant->cast(origin, direction, &hit)) {
    return std::min(shader_.skyRadiance(direction), brightest);
  }
  SurfacePoint point;
  point.direction = direction;
  point.position = origin + hit.distance_m * direction;
  point.geometric_normal = Eigen::Vector3f::UnitZ();
  point.triangle = hit.triangle;
  point.u = hit.u;
  point.v = hit.v;
  point.footprint_m = cone_rad * hit.distance_m;
  TracedLight traced;
  traced.sun_visibility = isShadowed(row, point.position) ? 0.0F : 1.0F;
  if (has_vehicle_lamps_) {
    traced.vehicle_lamps = vehicleLampsAt(row, point.position);
  }
  return shader_.shade(point, traced);
}

}  // namespace vcharge
