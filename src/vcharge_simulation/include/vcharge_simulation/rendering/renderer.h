#pragma once

#include <memory>
#include <optional>

#include <opencv2/core.hpp>

#include "vcharge_core/motion/rigid_transform.h"
#include "vcharge_simulation/scenes/scene.h"
#include "vcharge_simulation/sensors/camera_view.h"

namespace vcharge {

class RayTracer;

/// Ray traces a scene: four visibility samples per pixel, textures averaged over each sample's footprint,
/// sun, sky and bounced light. The same scene, view and pose give the same bytes on any number of threads
/// (TBB over image rows).
class Renderer {
 public:
  explicit Renderer(std::shared_ptr<const Scene> scene);
  ~Renderer();

  const Scene& scene() const { return *scene_; }

  /// time_s: of the scene, for its movers.
  ///
  /// Light on the sensor (CV_32FC1, 1 is white in the sun), blurred by the lens; outside the field of view
  /// only the light that the lens scatters.
  cv::Mat renderLight(const CameraView& view, const RigidTransform& world_from_vehicle,
                      double time_s = 0.0) const;

  /// Distance in metres along the ray through each pixel's centre (CV_32FC1): NaN where it meets nothing of
  /// the scene, meets the own car, or is outside the field of view.
  cv::Mat renderRange(const CameraView& view, const RigidTransform& world_from_vehicle,
                      double time_s = 0.0) const;

  /// Distance along a unit direction in the world to the first surface beyond min_distance_m; movers are not
  /// seen.
  std::optional<double> castRay(const Eigen::Vector3d& origin_m, const Eigen::Vector3d& direction,
                                double min_distance_m = 0.0, SurfaceKind* kind = nullptr) const;

 private:
  std::shared_ptr<const Scene> scene_;
  std::unique_ptr<const RayTracer> tracer_;
};

}  // namespace vcharge
