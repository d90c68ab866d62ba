#include "vcharge_simulation/rendering/renderer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include <tbb/parallel_for.h>

#include "rendering/ray_tracer.h"
#include "rendering/surface_shader.h"
#include "scenes/ground_finder.h"
#include "scenes/scene_instant.h"

namespace vcharge {

namespace {

constexpr int kSamples = CameraView::kSamplesPerBlock;
constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr float kMaxShadow_m = 150.0F;
// Offset of shadow ray origins from their surface.
constexpr float kShadowOffset_m = 0.01F;
// Reflections in glossy paint of the own car.
constexpr float kBrightestReflection = 2.0F;
constexpr float kMirroredCone_rad = 0.01F;

// Renders blocks of one image; holds what all blocks share.
class BlockRenderer {
 public:
  BlockRenderer(const Scene& scene, const SceneInstant& instant, const CameraView& view,
                const RigidTransform& world_from_vehicle)
      : instant_(instant),
        shader_(scene, instant.moving()),
        view_(view),
        sun_(scene.sky->directionToSun()),
        has_sun_(scene.sky->light().sun_irradiance > 0.0),
        vehicle_rotation_(world_from_vehicle.rotationMatrix().cast<float>()),
        vehicle_origin_(world_from_vehicle.translation().cast<float>()),
        sun_in_vehicle_(vehicle_rotation_.transpose() * sun_),
        rotation_((world_from_vehicle * *view.camera().vehicle_from_camera).rotationMatrix().cast<float>()),
        origin_((world_from_vehicle * *view.camera().vehicle_from_camera).translation().cast<float>()),
        ground_(instant, shader_, view, rotation_, origin_) {}

  void render(int block_x, int block_y, cv::Mat* light) const {
    const size_t block = static_cast<size_t>(block_y) * view_.blocksPerRow() + block_x;
    const uint8_t pixels = view_.blockPixels(block);
    if (pixels == 0) {
      return;
    }
    RTCRayHit16 rays;
    if (const GroundFinder::Plane* plane = ground_.planeOf(block); plane != nullptr) {
      renderGround(block_x, block_y, *plane, light);
      return;
    }
    const uint32_t body_mask = view_.blockBodyMask(block);
    trace(block, pixels, body_mask, &rays);
    std::array<float, 4> sun_visibility{1.0F, 1.0F, 1.0F, 1.0F};
    traceShadows(rays, pixels, body_mask, &sun_visibility);
    size_t next_body_sample = view_.blockBodyStart(block);
    for (int p = 0; p < 4; ++p) {
      if ((pixels >> p & 1) == 0) {
        continue;
      }
      const int x = 2 * block_x + p % 2;
      const int y = 2 * block_y + p / 2;
      if (meetsOneTriangle(rays, p, body_mask)) {
        const float footprint_m = rays.ray.tfar[4 * p] * view_.pixelAngle(x, y);
        light->at<float>(y, x) =
            shader_.shadePixel(
                {surfacePoint(rays, 4 * p, footprint_m), surfacePoint(rays, 4 * p + 1, footprint_m),
                 surfacePoint(rays, 4 * p + 2, footprint_m), surfacePoint(rays, 4 * p + 3, footprint_m)},
                sun_visibility[static_cast<size_t>(p)]) *
            view_.vignette().at<float>(y, x);
        continue;
      }
      float sum = 0.0F;
      float sky = -1.0F;
      for (int s = 0; s < CameraView::kSamplesPerPixel; ++s) {
        const int i = 4 * p + s;
        if ((body_mask >> i & 1U) != 0) {
          sum += shadeBody(view_.bodySamples()[next_body_sample++], direction(rays, i));
        } else if (rays.hit.geomID[i] == RTC_INVALID_GEOMETRY_ID) {
          if (sky < 0.0F) {
            sky = shader_.skyRadiance(direction(rays, i));
          }
          sum += sky;
        } else {
          const float footprint_m = rays.ray.tfar[i] * view_.pixelAngle(x, y);
          sum += shader_.shade(surfacePoint(rays, i, footprint_m), sun_visibility[static_cast<size_t>(p)]);
        }
      }
      light->at<float>(y, x) = sum * (1.0F / CameraView::kSamplesPerPixel) * view_.vignette().at<float>(y, x);
    }
  }

 private:
  static Eigen::Vector3f direction(const RTCRayHit16& rays, int i) {
    return {rays.ray.dir_x[i], rays.ray.dir_y[i], rays.ray.dir_z[i]};
  }

  Eigen::Vector3f positionOf(const RTCRayHit16& rays, int i) const {
    return origin_ + rays.ray.tfar[i] * direction(rays, i);
  }

  // The first and the last sample of a pixel are opposite each other about its centre.
  Eigen::Vector3f middleOfPixel(const RTCRayHit16& rays, int p) const {
    return 0.5F * (positionOf(rays, 4 * p) + positionOf(rays, 4 * p + 3));
  }

  static bool meetsOneTriangle(const RTCRayHit16& rays, int pixel, uint32_t body_mask) {
    const int i = CameraView::kSamplesPerPixel * pixel;
    const uint32_t triangle = rays.hit.primID[i];
    return (body_mask >> i & 0xFU) == 0 && rays.hit.geomID[i] != RTC_INVALID_GEOMETRY_ID &&
           rays.hit.geomID[i + 1] != RTC_INVALID_GEOMETRY_ID && rays.hit.primID[i + 1] == triangle &&
           rays.hit.geomID[i + 2] != RTC_INVALID_GEOMETRY_ID && rays.hit.primID[i + 2] == triangle &&
           rays.hit.geomID[i + 3] != RTC_INVALID_GEOMETRY_ID && rays.hit.primID[i + 3] == triangle;
  }

  SurfacePoint surfacePoint(const RTCRayHit16& rays, int i, float footprint_m) const {
    SurfacePoint point;
    point.direction = direction(rays, i);
    point.position = positionOf(rays, i);
    point.geometric_normal = {rays.hit.Ng_x[i], rays.hit.Ng_y[i], rays.hit.Ng_z[i]};
    point.triangle = rays.hit.primID[i];
    point.u = rays.hit.u[i];
    point.v = rays.hit.v[i];
    point.footprint_m = footprint_m;
    return point;
  }

  void renderGround(int block_x, int block_y, const GroundFinder::Plane& plane, cv::Mat* light) const {
    const float* rays = view_.blockRays(static_cast<size_t>(block_y) * view_.blocksPerRow() + block_x);
    const Material& material = shader_.materialOf(plane.triangle);
    // The rays are given in the camera frame.
    const Eigen::Vector3f normal = rotation_.transpose() * plane.normal;
    const float distance = plane.offset - plane.normal.dot(origin_);
    for (int p = 0; p < 4; ++p) {
      const int x = 2 * block_x + p % 2;
      const int y = 2 * block_y + p / 2;
      std::array<Eigen::Vector3f, CameraView::kSamplesPerPixel> positions;
      Eigen::Vector3f middle = Eigen::Vector3f::Zero();
      float range_m = 0.0F;
      for (int s = 0; s < CameraView::kSamplesPerPixel; ++s) {
        const float* sample = rays + CameraView::kSamplesPerPixel * p + s;
        const Eigen::Vector3f ray(sample[0], sample[kSamples], sample[2 * kSamples]);
        const float along = distance / normal.dot(ray);
        range_m += 0.25F * along;
        positions[static_cast<size_t>(s)] = origin_ + along * (rotation_ * ray);
        middle += 0.25F * positions[static_cast<size_t>(s)];
      }
      const float sun_visibility = isShadowed(middle) ? 0.0F : 1.0F;
      light->at<float>(y, x) =
          shader_.shadeGroundPixel(material, positions, plane.normal, (middle - origin_) / range_m,
                                   range_m * view_.pixelAngle(x, y), sun_visibility) *
          view_.vignette().at<float>(y, x);
    }
  }

  void trace(size_t block, uint8_t pixels, uint32_t body_mask, RTCRayHit16* rays) const {
    alignas(64) int active[kSamples];
    const float* x = view_.blockRays(block);
    const float* y = x + kSamples;
    const float* z = y + kSamples;
    for (int i = 0; i < kSamples; ++i) {
      rays->ray.org_x[i] = origin_.x();
      rays->ray.org_y[i] = origin_.y();
      rays->ray.org_z[i] = origin_.z();
      rays->ray.dir_x[i] = rotation_(0, 0) * x[i] + rotation_(0, 1) * y[i] + rotation_(0, 2) * z[i];
      rays->ray.dir_y[i] = rotation_(1, 0) * x[i] + rotation_(1, 1) * y[i] + rotation_(1, 2) * z[i];
      rays->ray.dir_z[i] = rotation_(2, 0) * x[i] + rotation_(2, 1) * y[i] + rotation_(2, 2) * z[i];
      rays->ray.tnear[i] = 0.0F;
      rays->ray.tfar[i] = kInfinity;
      rays->ray.time[i] = 0.0F;
      rays->ray.mask[i] = 0xFFFFFFFFU;
      rays->ray.id[i] = 0;
      rays->ray.flags[i] = 0;
      rays->hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
      rays->hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
      active[i] = (pixels >> (i / 4) & 1) != 0 && (body_mask >> i & 1U) == 0 ? -1 : 0;
    }
    instant_.intersect(active, rays);
  }

  // Traces one shadow ray per pixel: from its centre if one triangle fills it, otherwise from the first
  // sample that needs one.
  void traceShadows(const RTCRayHit16& rays, uint8_t pixels, uint32_t body_mask,
                    std::array<float, 4>* sun_visibility) const {
    if (!has_sun_) {
      return;
    }
    alignas(16) int active[4] = {0, 0, 0, 0};
    RTCRay4 shadow = {};
    bool any = false;
    for (int p = 0; p < 4; ++p) {
      for (int i = 4 * p; i < 4 * p + 4 && active[p] == 0; ++i) {
        if ((pixels >> p & 1) == 0 || (body_mask >> i & 1U) != 0 ||
            rays.hit.geomID[i] == RTC_INVALID_GEOMETRY_ID) {
          continue;
        }
        const Eigen::Vector3f position =
            i == 4 * p && meetsOneTriangle(rays, p, body_mask) ? middleOfPixel(rays, p) : positionOf(rays, i);
        const Material& material = shader_.materialOf(rays.hit.primID[i]);
        if (isShadowed(position)) {
          (*sun_visibility)[static_cast<size_t>(p)] = 0.0F;
          break;
        }
        if (SurfaceShader::hasBakedSun(material)) {
          continue;
        }
        Eigen::Vector3f normal =
            Eigen::Vector3f(rays.hit.Ng_x[i], rays.hit.Ng_y[i], rays.hit.Ng_z[i]).normalized();
        if (normal.dot(direction(rays, i)) > 0.0F) {
          normal = -normal;
        }
        if (normal.dot(sun_) <= 0.0F && material.translucency == 0.0F) {
          continue;
        }
        const Eigen::Vector3f start = position + kShadowOffset_m * (normal.dot(sun_) > 0.0F ? normal : sun_);
        shadow.org_x[p] = start.x();
        shadow.org_y[p] = start.y();
        shadow.org_z[p] = start.z();
        shadow.dir_x[p] = sun_.x();
        shadow.dir_y[p] = sun_.y();
        shadow.dir_z[p] = sun_.z();
        shadow.tfar[p] = kMaxShadow_m;
        shadow.mask[p] = 0xFFFFFFFFU;
        active[p] = -1;
        any = true;
      }
    }
    if (!any) {
      return;
    }
    instant_.findOccluded(active, &shadow);
    for (int p = 0; p < 4; ++p) {
      if (active[p] != 0 && shadow.tfar[p] < 0.0F) {
        (*sun_visibility)[static_cast<size_t>(p)] = 0.0F;
      }
    }
  }

  // Shadows that no light map contains: those of the own car and of movers.
  bool isShadowed(const Eigen::Vector3f& position) const {
    return has_sun_ && (isShadowedByBody(position) || instant_.isShadowedByMover(position, sun_));
  }

  bool isShadowedByBody(const Eigen::Vector3f& position) const {
    if (view_.body() == nullptr) {
      return false;
    }
    const Eigen::Vector3f in_vehicle = vehicle_rotation_.transpose() * (position - vehicle_origin_);
    // The shadow ray must pass within the body's radius.
    const float along = -in_vehicle.dot(sun_in_vehicle_);
    const float radius = view_.body()->radius();
    if (along < -radius || (in_vehicle + along * sun_in_vehicle_).squaredNorm() > radius * radius) {
      return false;
    }
    return view_.body()->tracer().occluded(in_vehicle + kShadowOffset_m * sun_in_vehicle_, sun_in_vehicle_,
                                           kMaxShadow_m);
  }

  float shadeBody(const CameraView::BodySample& sample, const Eigen::Vector3f& ray) const {
    const Material& material = view_.body()->materials()[sample.material];
    const Eigen::Vector3f position = vehicle_origin_ + vehicle_rotation_ * sample.position;
    const Eigen::Vector3f normal = vehicle_rotation_ * sample.normal;
    if (!view_.body()->isGlossy() || material.reflectivity <= 0.0F) {
      return shader_.shadePlain(material, position, normal, ray);
    }
    return shader_.shadeMatt(material, position, normal) +
           SurfaceShader::fresnel(material, normal, ray) *
               mirroredLight(position + kShadowOffset_m * normal, ray - 2.0F * normal.dot(ray) * normal);
  }

  // Light that reaches a mirroring surface from a direction. The paint's curvature widens the ray's cone.
  float mirroredLight(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction) const {
    RayTracer::Hit hit;
    if (!instant_.cast(origin, direction, &hit)) {
      return std::min(shader_.skyRadiance(direction), kBrightestReflection);
    }
    SurfacePoint point;
    point.direction = direction;
    point.position = origin + hit.distance_m * direction;
    point.geometric_normal = Eigen::Vector3f::UnitZ();
    point.triangle = hit.triangle;
    point.u = hit.u;
    point.v = hit.v;
    point.footprint_m = kMirroredCone_rad * hit.distance_m;
    return shader_.shade(point, isShadowed(point.position) ? 0.0F : 1.0F);
  }

  const SceneInstant& instant_;
  const SurfaceShader shader_;
  const CameraView& view_;
  const Eigen::Vector3f sun_;
  const bool has_sun_;
  const Eigen::Matrix3f vehicle_rotation_;
  const Eigen::Vector3f vehicle_origin_, sun_in_vehicle_;
  const Eigen::Matrix3f rotation_;  // world_from_camera
  const Eigen::Vector3f origin_;
  const GroundFinder ground_;
};

}  // namespace

Renderer::Renderer(std::shared_ptr<const Scene> scene)
    : scene_(std::move(scene)), tracer_(std::make_unique<const RayTracer>(scene_->mesh)) {}

Renderer::~Renderer() = default;

cv::Mat Renderer::renderLight(const CameraView& view, const RigidTransform& world_from_vehicle,
                              double time_s) const {
  cv::Mat light = cv::Mat::zeros(view.size(), CV_32FC1);
  const SceneInstant instant(*scene_, *tracer_, time_s);
  const BlockRenderer renderer(*scene_, instant, view, world_from_vehicle);
  tbb::parallel_for(0, view.blockRows(), [&](int block_y) {
    for (int block_x = 0; block_x < view.blocksPerRow(); ++block_x) {
      renderer.render(block_x, block_y, &light);
    }
  });
  view.blur().apply(&light);
  light += cv::Scalar(view.lens().veil * cv::mean(light)[0]);
  return light;
}

cv::Mat Renderer::renderRange(const CameraView& view, const RigidTransform& world_from_vehicle,
                              double time_s) const {
  const SceneInstant instant(*scene_, *tracer_, time_s);
  const RigidTransform world_from_camera = world_from_vehicle * *view.camera().vehicle_from_camera;
  const Eigen::Matrix3f rotation = world_from_camera.rotationMatrix().cast<float>();
  const Eigen::Vector3f origin = world_from_camera.translation().cast<float>();
  const Eigen::Matrix3f vehicle_from_camera =
      view.camera().vehicle_from_camera->rotationMatrix().cast<float>();
  const Eigen::Vector3f origin_in_vehicle = view.camera().vehicle_from_camera->translation().cast<float>();
  cv::Mat range_m(view.size(), CV_32FC1, cv::Scalar(std::numeric_limits<float>::quiet_NaN()));
  tbb::parallel_for(0, view.size().height, [&](int y) {
    for (int x = 0; x < view.size().width; ++x) {
      const Eigen::Vector3f ray = view.centreRay(x, y);
      RayTracer::Hit hit;
      if (ray.isZero() || !instant.cast(origin, rotation * ray, &hit)) {
        continue;
      }
      RayTracer::Hit body_hit;
      const bool on_body =
          view.mask().at<uint8_t>(y, x) == 0 && view.body() != nullptr &&
          view.body()->tracer().cast(origin_in_vehicle, vehicle_from_camera * ray, &body_hit);
      if (!on_body) {
        range_m.at<float>(y, x) = hit.distance_m;
      }
    }
  });
  return range_m;
}

std::optional<double> Renderer::castRay(const Eigen::Vector3d& origin_m, const Eigen::Vector3d& direction,
                                        double min_distance_m, SurfaceKind* kind) const {
  RayTracer::Hit hit;
  if (!tracer_->cast(origin_m.cast<float>(), direction.cast<float>(), &hit,
                     static_cast<float>(min_distance_m))) {
    return std::nullopt;
  }
  if (kind != nullptr) {
    *kind = scene_->materials[scene_->mesh.triangles[hit.triangle].material].kind;
  }
  return hit.distance_m;
}

}  // namespace vcharge
