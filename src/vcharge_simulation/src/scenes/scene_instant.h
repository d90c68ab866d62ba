#pragma once

#include <optional>

#include "rendering/ray_tracer.h"
#include "vcharge_simulation/scenes/scene.h"

namespace vcharge {

/// A scene at one time: its fixed mesh, and its movers as they stand then. The movers' triangles count on
/// after those of the fixed mesh. Queries are thread safe.
class SceneInstant {
 public:
  /// `fixed` is over scene.mesh; both must outlive this.
  SceneInstant(const Scene& scene, const RayTracer& fixed, double time_s);
  SceneInstant(const SceneInstant&) = delete;
  SceneInstant& operator=(const SceneInstant&) = delete;

  /// The movers' triangles in the world frame.
  const TriangleMesh& moving() const { return moving_; }

  /// First surface along each active ray.
  void intersect(const int* active, RTCRayHit16* rays) const;
  /// As Embree: sets tfar of the active rays that meet anything below zero.
  void findOccluded(const int* active, RTCRay4* rays) const;
  bool cast(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction, RayTracer::Hit* hit) const;
  /// Whether a mover stands between a place and the sun.
  bool isShadowedByMover(const Eigen::Vector3f& position, const Eigen::Vector3f& direction_to_sun) const;

 private:
  const RayTracer& fixed_;
  const uint32_t num_fixed_triangles_;
  TriangleMesh moving_;
  std::optional<RayTracer> moving_tracer_;
  Eigen::Vector3f centre_ = Eigen::Vector3f::Zero();  // of a sphere around all movers
  float radius_m_ = 0.0F;
};

}  // namespace vcharge
