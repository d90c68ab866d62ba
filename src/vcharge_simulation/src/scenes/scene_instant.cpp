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
    moving_.append(mover.stateAt(time_s).mesh, Eigen::Isometry3f::Identity());
  }
  if (moving_.triangles.empty()) {
    return;
  }
  moving_tracer_.emplace(moving_, kMovingGeometry);
  Eigen::Vector3f low = moving_.vertices.front().position;
  Eigen::Vector3f high = low;
  for (const MeshVertex& vertex : moving_.vertices) {
    low = low.cwiseMin(vertex.position);
    high = high.cwiseMax(vertex.position);
  }
  centre_ = 0.5F * (low + high);
  radius_m_ = 0.5F * (high - low).norm();
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

bool SceneInstant::isShadowedByMover(const Eigen::Vector3f& position,
                                     const Eigen::Vector3f& direction_to_sun) const {
  if (!moving_tracer_) {
    return false;
  }
  // The ray to the sun must pass within the sphere around all movers.
  const Eigen::Vector3f to_centre = centre_ - position;
  const float along = to_centre.dot(direction_to_sun);
  if (along < -radius_m_ || (to_centre - along * direction_to_sun).squaredNorm() > radius_m_ * radius_m_) {
    return false;
  }
  return moving_tracer_->occluded(position + kShadowOffset_m * direction_to_sun, direction_to_sun,
                                  kMaxShadow_m);
}

}  // namespace vcharge
