#pragma once

#include <functional>
#include <optional>

#include <opencv2/core.hpp>

#include "vcharge_simulation/scenes/scene.h"
#include "vcharge_simulation/sensors/camera_view.h"
#include "vcharge_simulation/sensors/readout.h"

namespace vcharge {

/// Adds the light of a point source that the lens scatters: `peak` at its centre, half of it at the radius,
/// and further away falling with the square of the distance (CIE glare equation).
void addGlare(const Eigen::Vector2d& centre_px, double peak, double radius_px, cv::Mat* light);
/// The same of a lamp with this illuminance at the lens; `scatter` is 1 for a dirty lens.
void addLampGlare(const Eigen::Vector2d& centre_px, double illuminance_lx, double scatter, cv::Mat* light);
/// The sun's glare in a dirty lens.
void addSunGlare(const Eigen::Vector2d& centre_px, double illuminance_lx, double scatter, cv::Mat* light);

/// Where the camera sees a point while that row is exposed.
struct SeenPoint {
  Eigen::Vector2d pixel;
  Eigen::Vector3d camera_m;  ///< position of the camera in the world frame
};
/// `point` is homogeneous: (x, y, z, 1) in metres, or (x, y, z, 0) for a direction, in the world frame.
/// Nothing if it is outside the image, the field of view or behind the own car.
std::optional<SeenPoint> findPoint(const CameraView& view, const Readout& readout,
                                   const Eigen::Vector4d& point);

/// Glare of a scene's sun and lamps in a clean lens, with ghosts of the sun. Immutable, thread safe.
class LensGlare {
 public:
  /// True if no surface lies between a point and another one, or in a direction if w is 0 (see findPoint).
  using IsVisible = std::function<bool(const Eigen::Vector3d& from_m, const Eigen::Vector4d& to)>;
  static constexpr double kCleanScatter = 1.0 / 16.0;  ///< as much as a healthy eye

  /// `scene` must outlive this object.
  LensGlare(const Scene& scene, IsVisible is_visible);
  /// `light` is CV_32FC1, where 1 is white in the sun.
  void apply(const CameraView& view, const Readout& readout, cv::Mat* light) const;

 private:
  const Scene& scene_;
  IsVisible is_visible_;
};

}  // namespace vcharge
