#pragma once

#include <memory>
#include <optional>

#include <opencv2/core.hpp>

#include "vcharge_simulation/scenes/scene.h"
#include "vcharge_simulation/sensors/camera_view.h"
#include "vcharge_simulation/sensors/readout.h"

namespace vcharge {

class RayTracer;

/// Ray traces a scene with four visibility samples per pixel; textures are averaged over the footprint of
/// each sample, and light comes from sun, sky and ground. The same scene, view and pose give the same bytes
/// for any number of threads (TBB over image rows).
class Renderer {
 public:
  explicit Renderer(std::shared_ptr<const Scene> scene);
  ~Renderer();

  const Scene& scene() const { return *scene_; }

  /// Light on the sensor (CV_32FC1, where 1 is white in the sun), blurred by the lens. Pixels outside the
  /// field of view hold only the light scattered by the lens. `time_s` is the scene time at the stamp and
  /// determines the movers' poses. Two neighbouring rows share one instant of the readout.
  cv::Mat renderLight(const CameraView& view, const Readout& readout, double time_s = 0.0) const;

  /// Distance in metres along the ray through each pixel centre (CV_32FC1), from the camera's position while
  /// that row is exposed; NaN where the ray meets no surface, meets the own car, or lies outside the field of
  /// view.
  cv::Mat renderRange(const CameraView& view, const Readout& readout, double time_s = 0.0) const;

  /// Distance along a unit direction in the world frame to the first surface beyond min_distance_m. Movers
  /// are ignored.
  std::optional<double> castRay(const Eigen::Vector3d& origin_m, const Eigen::Vector3d& direction,
                                double min_distance_m = 0.0, SurfaceKind* kind = nullptr) const;

 private:
  std::shared_ptr<const Scene> scene_;
  std::unique_ptr<const RayTracer> tracer_;
};

}  // namespace vcharge
