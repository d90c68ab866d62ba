#include "vcharge_simulation/rendering/renderer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include <tbb/parallel_for.h>

#include "lighting/secondary_light.h"
#include "rendering/exposed_rows.h"
#include "rendering/ray_tracer.h"
#include "rendering/surface_shader.h"
#include "scenes/ground_finder.h"

namespace vcharge {

namespace {

constexpr int kSamples = CameraView::kSamplesPerBlock;
constexpr float kInfinity = std::numeric_limits<float>::infinity();

// Renders blocks of one image; holds what all blocks share.
class BlockRenderer {
 public:
  BlockRenderer(const Scene& scene, const ExposedRows& rows, const CameraView& view)
      : rows_(rows),
        shader_(scene, rows.moving()),
        secondary_(scene, shader_, view),
        view_(view),
        sun_(scene.sky->directionToSun()),
        ground_(rows, shader_, view) {}

  void render(int block_x, int block_y, cv::Mat* light) const {
    const ExposedRow& row = rows_[block_y];
    const size_t block = static_cast<size_t>(block_y) * view_.blocksPerRow() + block_x;
    const uint8_t pixels = view_.blockPixels(block);
    if (pixels == 0) {
      return;
    }
    RTCRayHit16 rays;
    if (const GroundFinder::Plane* plane = ground_.planeOf(block); plane != nullptr) {
      renderGround(row, block_x, block_y, *plane, light);
      return;
    }
    const uint32_t body_mask = view_.blockBodyMask(block);
    trace(row, block, pixels, body_mask, &rays);
    std::array<TracedLight, 4> traced;
    traceShadows(row, rays, pixels, body_mask, &traced);
    traceVehicleLamps(row, rays, pixels, body_mask, &traced);
    size_t next_body_sample = view_.blockBodyStart(block);
    for (int p = 0; p < 4; ++p) {
      if ((pixels >> p & 1) == 0) {
        continue;
      }
      const int x = 2 * block_x + p % 2;
      const int y = 2 * block_y + p / 2;
      if (meetsOneTriangle(rays, p, body_mask)) {
        const float footprint_m = rays.ray.tfar[4 * p] * view_.pixelAngle(x, y);
        const std::array<SurfacePoint, 4> points = {
            surfacePoint(row, rays, 4 * p, footprint_m), surfacePoint(row, rays, 4 * p + 1, footprint_m),
            surfacePoint(row, rays, 4 * p + 2, footprint_m), surfacePoint(row, rays, 4 * p + 3, footprint_m)};
        light->at<float>(y, x) =
            wettedPixel(row, points, shader_.shadePixel(points, traced[static_cast<size_t>(p)])) *
            view_.vignette().at<float>(y, x);
        continue;
      }
      float sum = 0.0F;
      float sky = -1.0F;
      for (int s = 0; s < CameraView::kSamplesPerPixel; ++s) {
        const int i = 4 * p + s;
        if ((body_mask >> i & 1U) != 0) {
          sum += secondary_.shadeBody(row, view_.bodySamples()[next_body_sample++], direction(rays, i));
        } else if (rays.hit.geomID[i] == RTC_INVALID_GEOMETRY_ID) {
          if (sky < 0.0F) {
            sky = shader_.skyRadiance(direction(rays, i));
          }
          sum += sky;
        } else {
          const float footprint_m = rays.ray.tfar[i] * view_.pixelAngle(x, y);
          const SurfacePoint point = surfacePoint(row, rays, i, footprint_m);
          sum += wetted(row, point, shader_.shade(point, traced[static_cast<size_t>(p)]));
        }
      }
      light->at<float>(y, x) = sum * (1.0F / CameraView::kSamplesPerPixel) * view_.vignette().at<float>(y, x);
    }
  }

 private:
  static Eigen::Vector3f direction(const RTCRayHit16& rays, int i) {
    return {rays.ray.dir_x[i], rays.ray.dir_y[i], rays.ray.dir_z[i]};
  }

  static Eigen::Vector3f positionOf(const ExposedRow& row, const RTCRayHit16& rays, int i) {
    return row.origin + rays.ray.tfar[i] * direction(rays, i);
  }

  // The first and the last sample of a pixel are opposite each other about its centre.
  static Eigen::Vector3f middleOfPixel(const ExposedRow& row, const RTCRayHit16& rays, int p) {
    return 0.5F * (positionOf(row, rays, 4 * p) + positionOf(row, rays, 4 * p + 3));
  }

  static bool meetsOneTriangle(const RTCRayHit16& rays, int pixel, uint32_t body_mask) {
    const int i = CameraView::kSamplesPerPixel * pixel;
    const uint32_t triangle = rays.hit.primID[i];
    return (body_mask >> i & 0xFU) == 0 && rays.hit.geomID[i] != RTC_INVALID_GEOMETRY_ID &&
           rays.hit.geomID[i + 1] != RTC_INVALID_GEOMETRY_ID && rays.hit.primID[i + 1] == triangle &&
           rays.hit.geomID[i + 2] != RTC_INVALID_GEOMETRY_ID && rays.hit.primID[i + 2] == triangle &&
           rays.hit.geomID[i + 3] != RTC_INVALID_GEOMETRY_ID && rays.hit.primID[i + 3] == triangle;
  }

  static SurfacePoint surfacePoint(const ExposedRow& row, const RTCRayHit16& rays, int i, float footprint_m) {
    SurfacePoint point;
    point.direction = direction(rays, i);
    point.position = positionOf(row, rays, i);
    point.geometric_normal = {rays.hit.Ng_x[i], rays.hit.Ng_y[i], rays.hit.Ng_z[i]};
    point.triangle = rays.hit.primID[i];
    point.u = rays.hit.u[i];
    point.v = rays.hit.v[i];
    point.footprint_m = footprint_m;
    return point;
  }

  void renderGround(const ExposedRow& row, int block_x, int block_y, const GroundFinder::Plane& plane,
                    cv::Mat* light) const {
    const float* rays = view_.blockRays(static_cast<size_t>(block_y) * view_.blocksPerRow() + block_x);
    const Material& material = shader_.materialOf(plane.triangle);
    // The rays are given in the camera frame.
    const Eigen::Vector3f normal = row.rotation.transpose() * plane.normal;
    const float distance = plane.offset - plane.normal.dot(row.origin);
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
        positions[static_cast<size_t>(s)] = row.origin + along * (row.rotation * ray);
        middle += 0.25F * positions[static_cast<size_t>(s)];
      }
      TracedLight traced;
      traced.sun_visibility = secondary_.isShadowed(row, middle) ? 0.0F : 1.0F;
      if (secondary_.hasVehicleLamps()) {
        traced.vehicle_lamps = secondary_.vehicleLampsAt(row, middle);
      }
      const Eigen::Vector3f direction = (middle - row.origin) / range_m;
      const float footprint_m = range_m * view_.pixelAngle(x, y);
      float ground =
          shader_.shadeGroundPixel(material, positions, plane.normal, direction, footprint_m, traced);
      if (material.wetness > 0.0F) {
        std::array<Eigen::Vector3f, CameraView::kSamplesPerPixel> directions;
        for (size_t s = 0; s < positions.size(); ++s) {
          directions[s] = (positions[s] - row.origin).normalized();
        }
        ground = wetted(row, ground, material.wetness, plane.normal, positions, directions, footprint_m);
      }
      light->at<float>(y, x) = ground * view_.vignette().at<float>(y, x);
    }
  }

  // Light of a surface with the reflection in the water on it.
  float wetted(const ExposedRow& row, const SurfacePoint& point, float dry) const {
    const float wetness = shader_.materialOf(point.triangle).wetness;
    if (wetness <= 0.0F) {
      return dry;
    }
    return secondary_.wetted(row, dry, wetness, point.position, point.geometric_normal.normalized(),
                             point.direction, point.footprint_m);
  }

  // Light of a pixel whose samples meet one triangle.
  float wettedPixel(const ExposedRow& row,
                    const std::array<SurfacePoint, CameraView::kSamplesPerPixel>& points, float dry) const {
    const float wetness = shader_.materialOf(points[0].triangle).wetness;
    if (wetness <= 0.0F) {
      return dry;
    }
    std::array<Eigen::Vector3f, CameraView::kSamplesPerPixel> positions;
    std::array<Eigen::Vector3f, CameraView::kSamplesPerPixel> directions;
    for (size_t s = 0; s < points.size(); ++s) {
      positions[s] = points[s].position;
      directions[s] = points[s].direction;
    }
    return wetted(row, dry, wetness, points[0].geometric_normal.normalized(), positions, directions,
                  points[0].footprint_m);
  }

  // Mean over the samples, since outlines in the mirror image are as sharp as those of the things.
  float wetted(const ExposedRow& row, float dry, float wetness, const Eigen::Vector3f& normal,
               const std::array<Eigen::Vector3f, CameraView::kSamplesPerPixel>& positions,
               const std::array<Eigen::Vector3f, CameraView::kSamplesPerPixel>& directions,
               float footprint_m) const {
    float sum = 0.0F;
    for (size_t s = 0; s < positions.size(); ++s) {
      sum += secondary_.wetted(row, dry, wetness, positions[s], normal, directions[s], footprint_m);
    }
    return sum / static_cast<float>(CameraView::kSamplesPerPixel);
  }

  void trace(const ExposedRow& row, size_t block, uint8_t pixels, uint32_t body_mask,
             RTCRayHit16* rays) const {
    alignas(64) int active[kSamples];
    const float* x = view_.blockRays(block);
    const float* y = x + kSamples;
    const float* z = y + kSamples;
    for (int i = 0; i < kSamples; ++i) {
      rays->ray.org_x[i] = row.origin.x();
      rays->ray.org_y[i] = row.origin.y();
      rays->ray.org_z[i] = row.origin.z();
      rays->ray.dir_x[i] = row.rotation(0, 0) * x[i] + row.rotation(0, 1) * y[i] + row.rotation(0, 2) * z[i];
      rays->ray.dir_y[i] = row.rotation(1, 0) * x[i] + row.rotation(1, 1) * y[i] + row.rotation(1, 2) * z[i];
      rays->ray.dir_z[i] = row.rotation(2, 0) * x[i] + row.rotation(2, 1) * y[i] + row.rotation(2, 2) * z[i];
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
    row.instant->intersect(active, rays);
  }

  // Traces one shadow ray per pixel: from its centre if one triangle fills it, otherwise from the first
  // sample that needs one.
  void traceShadows(const ExposedRow& row, const RTCRayHit16& rays, uint8_t pixels, uint32_t body_mask,
                    std::array<TracedLight, 4>* traced) const {
    if (!secondary_.hasSun()) {
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
        const Eigen::Vector3f position = i == 4 * p && meetsOneTriangle(rays, p, body_mask)
                                             ? middleOfPixel(row, rays, p)
                                             : positionOf(row, rays, i);
        const Material& material = shader_.materialOf(rays.hit.primID[i]);
        if (secondary_.isShadowed(row, position)) {
          (*traced)[static_cast<size_t>(p)].sun_visibility = 0.0F;
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
    row.instant->findOccluded(active, &shadow);
    for (int p = 0; p < 4; ++p) {
      if (active[p] != 0 && shadow.tfar[p] < 0.0F) {
        (*traced)[static_cast<size_t>(p)].sun_visibility = 0.0F;
      }
    }
  }

  // Traces the own car's lamps once per pixel, from the first sample that meets the scene.
  void traceVehicleLamps(const ExposedRow& row, const RTCRayHit16& rays, uint8_t pixels, uint32_t body_mask,
                         std::array<TracedLight, 4>* traced) const {
    for (int p = 0; secondary_.hasVehicleLamps() && p < 4; ++p) {
      for (int i = 4 * p; i < 4 * p + 4; ++i) {
        if ((pixels >> p & 1) != 0 && (body_mask >> i & 1U) == 0 &&
            rays.hit.geomID[i] != RTC_INVALID_GEOMETRY_ID) {
          (*traced)[static_cast<size_t>(p)].vehicle_lamps =
              secondary_.vehicleLampsAt(row, positionOf(row, rays, i));
          break;
        }
      }
    }
  }

  const ExposedRows& rows_;
  const SurfaceShader shader_;
  const SecondaryLight secondary_;
  const CameraView& view_;
  const Eigen::Vector3f sun_;
  const GroundFinder ground_;
};

}  // namespace

Renderer::Renderer(std::shared_ptr<const Scene> scene)
    : scene_(std::move(scene)), tracer_(std::make_unique<const RayTracer>(scene_->mesh)) {}

Renderer::~Renderer() = default;

cv::Mat Renderer::renderLight(const CameraView& view, const Readout& readout, double time_s) const {
  cv::Mat light = cv::Mat::zeros(view.size(), CV_32FC1);
  const ExposedRows rows(*scene_, *tracer_, view, readout, time_s);
  const BlockRenderer renderer(*scene_, rows, view);
  tbb::parallel_for(0, view.blockRows(), [&](int block_y) {
    for (int block_x = 0; block_x < view.blocksPerRow(); ++block_x) {
      renderer.render(block_x, block_y, &light);
    }
  });
  view.blur().apply(&light);
  light += cv::Scalar(view.lens().veil * cv::mean(light)[0]);
  return light;
}

cv::Mat Renderer::renderRange(const CameraView& view, const Readout& readout, double time_s) const {
  const ExposedRows rows(*scene_, *tracer_, view, readout, time_s);
  const Eigen::Matrix3f vehicle_from_camera =
      view.camera().vehicle_from_camera->rotationMatrix().cast<float>();
  const Eigen::Vector3f origin_in_vehicle = view.camera().vehicle_from_camera->translation().cast<float>();
  cv::Mat range_m(view.size(), CV_32FC1, cv::Scalar(std::numeric_limits<float>::quiet_NaN()));
  tbb::parallel_for(0, view.size().height, [&](int y) {
    const ExposedRow& row = rows[y / 2];
    for (int x = 0; x < view.size().width; ++x) {
      const Eigen::Vector3f ray = view.centreRay(x, y);
      RayTracer::Hit hit;
      if (ray.isZero() || !row.instant->cast(row.origin, row.rotation * ray, &hit)) {
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
