#pragma once

#include <optional>
#include <vector>

#include "rendering/ray_tracer.h"
#include "vcharge_simulation/scenes/scene.h"

namespace vcharge {

/// A scene at one time: its static mesh and the movers' meshes. The movers' triangles are numbered after
/// those of the static mesh. Queries are thread safe.
class SceneInstant {
 public:
  /// `fixed` traces scene.mesh; both arguments must outlive this object.
  SceneInstant(const Scene& scene, const RayTracer& fixed, double time_s);
  SceneInstant(const SceneInstant&) = delete;
  SceneInstant& operator=(const SceneInstant&) = delete;

  /// Triangles of the movers in the world frame.
  const TriangleMesh& moving() const { return moving_; }

  /// Finds the first surface along each active ray.
  void intersect(const int* active, RTCRayHit16* rays) const;
  /// Sets tfar of the active rays that are occluded to a negative value, as Embree does.
  void findOccluded(const int* active, RTCRay4* rays) const;
  bool cast(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction, RayTracer::Hit* hit) const;
  /// True if any surface lies within max_distance_m along a unit direction.
  bool occluded(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction, float max_distance_m) const;
  /// True if a mover occludes the sun.
  bool isShadowedByMover(const Eigen::Vector3f& position, const Eigen::Vector3f& direction_to_sun) const;

 private:
  const RayTracer& fixed_;
  const uint32_t num_fixed_triangles_;
  TriangleMesh moving_;
  std::optional<RayTracer> moving_tracer_;
  struct Sphere {
    Eigen::Vector3f centre;
    float radius_m;
  };
  std::vector<Sphere> spheres_;  // around each mover
};

}  // namespace vcharge
