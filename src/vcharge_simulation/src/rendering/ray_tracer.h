#pragma once

#include <embree3/rtcore.h>

#include <Eigen/Core>

#include "vcharge_simulation/rendering/mesh.h"

namespace vcharge {

/// Embree's acceleration structure over one mesh, which must outlive it. Queries are thread safe.
class RayTracer {
 public:
  /// `geometry_id` identifies the mesh in Embree's hits.
  explicit RayTracer(const TriangleMesh& mesh, unsigned geometry_id = 0);
  ~RayTracer();
  RayTracer(const RayTracer&) = delete;
  RayTracer& operator=(const RayTracer&) = delete;

  RTCScene scene() const { return scene_; }

  struct Hit {
    float distance_m;
    uint32_t triangle;
    float u, v;  ///< barycentric: the weights of the triangle's second and third vertex
    Eigen::Vector3f normal(const TriangleMesh& mesh) const;  ///< interpolated, unit
  };
  /// First surface beyond min_distance_m along a unit direction; false if there is none.
  bool cast(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction, Hit* hit,
            float min_distance_m = 0.0F) const;
  /// True if any surface lies within max_distance_m.
  bool occluded(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction, float max_distance_m) const;

 private:
  RTCDevice device_;
  RTCScene scene_;
};

}  // namespace vcharge
