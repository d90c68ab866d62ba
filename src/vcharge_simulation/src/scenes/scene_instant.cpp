#include "scenes/scene_instant.h"

#include <algorithm>

namespace vcharge {

namespace {

constexpr unsigned kMovingGeometry = 1;
constexpr float kShadowOffset_m = 0.01F;
constexpr float kMaxShadow_m = 150.0F;

}  // namespace

SceneInstant::SceneInstant(const Scene& scene, const RayTracer& fixed, double time_s)
    : fixed_(fixed), num_fixed_triangles_(static_cast<uint32_t>(scene.mesh.triangles.size())) {
  for (const Mover& mover : scene.movers) {
    const TriangleMesh mesh = mover.meshAt(time_s);
    if (mesh.triangles.empty()) {
      continue;
    }
    moving_.append(mesh, Eigen::Isometry3f::Identity());
    Eigen::AlignedBox3f box;
    for (const MeshVertex& vertex : mesh.vertices) {
      box.extend(vertex.position);
    }
    spheres_.push_back({box.center(), 0.5F * box.diagonal().norm()});
  }
  if (!moving_.triangles.empty()) {
    moving_tracer_.emplace(moving_, kMovingGeometry);
  }
}

void SceneInstant::intersect(const int* active, RTCRayHit16* rays) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  rtcIntersect16(active, fixed_.scene(), &context, rays);
  if (!moving_tracer_) {
    return;
  }
  // The first query set tfar, so only nearer movers replace its hits.
  rtcIntersect16(active, moving_tracer_->scene(), &context, rays);
  for (int i = 0; i < 16; ++i) {
    if (active[i] != 0 && rays->hit.geomID[i] == kMovingGeometry) {
      rays->hit.primID[i] += num_fixed_triangles_;
    }
  }
}

void SceneInstant::findOccluded(const int* active, RTCRay4* rays) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  rtcOccluded4(active, fixed_.scene(), &context, rays);
  if (moving_tracer_) {
    rtcOccluded4(active, moving_tracer_->scene(), &context, rays);
  }
}

bool SceneInstant::cast(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction,
                        RayTracer::Hit* hit) const {
  const bool meets_fixed = fixed_.cast(origin, direction, hit);
  RayTracer::Hit moving_hit;
  if (!moving_tracer_ || !moving_tracer_->cast(origin, direction, &moving_hit) ||
      (meets_fixed && hit->distance_m <= moving_hit.distance_m)) {
    return meets_fixed;
  }
  *hit = moving_hit;
  hit->triangle += num_fixed_triangles_;
  return true;
}

bool SceneInstant::occluded(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction,
                            float max_distance_m) const {
  return fixed_.occluded(origin, direction, max_distance_m) ||
         (moving_tracer_ && moving_tracer_->occluded(origin, direction, max_distance_m));
}

bool SceneInstant::isShadowedByMover(const Eigen::Vector3f& position,
                                     const Eigen::Vector3f& direction_to_sun) const {
  // The ray to the sun must pass within the sphere around a mover.
  const bool passes_one = std::any_of(spheres_.begin(), spheres_.end(), [&](const Sphere& sphere) {
    const Eigen::Vector3f to_centre = sphere.centre - position;
    const float along = to_centre.dot(direction_to_sun);
    return along >= -sphere.radius_m &&
           (to_centre - along * direction_to_sun).squaredNorm() <= sphere.radius_m * sphere.radius_m;
  });
  return passes_one && moving_tracer_->occluded(position + kShadowOffset_m * direction_to_sun,
                                                direction_to_sun, kMaxShadow_m);
}

}  // namespace vcharge
