#pragma once

#include <deque>
#include <memory>
#include <vector>

#include <opencv2/core.hpp>

#include "vcharge_core/base/options.h"
#include "vcharge_core/base/timestamp.h"
#include "vcharge_core/camera/working_camera.h"
#include "vcharge_core/motion/rigid_transform.h"
#include "vcharge_obstacles/ground_plane.h"
#include "vcharge_obstacles/polar_grid.h"

namespace vcharge {

/// Options of GroundWatch.
struct GroundWatchOptions {
  VCHARGE_BEGIN_OPTIONS(GroundWatchOptions);
  VCHARGE_OPTION(double, min_difference, 7.0, positive(), "Gray levels by which changed ground differs.");
  VCHARGE_END_OPTIONS();
};

/// What the images of a camera tell about the ground, by PolarGrid::index.
struct GroundAppearance {
  std::vector<float> changed_fraction;  ///< pixels that have changed; empty without an earlier image
  std::vector<float> ground_pixels;     ///< number of pixels that show the ground, less those that do not
};

/// What the images of a camera at rest tell about the ground, by PolarGrid::index.
struct StandingAppearance {
  std::vector<float> changed_fraction;  ///< pixels that have changed; empty without an earlier image
  std::vector<float> same_fraction;  ///< pixels that show the texture of the first image; empty without one
  Timestamp first;                   ///< stamp of the first image, taken once the body had come to rest
};

/// Compares the images of a camera by the plane of the ground. Whatever moves or rises above the ground does
/// not fit. Motion stereo assumes a static scene and cannot range moving objects, and has few ranges near the
/// direction of travel; this comparison needs no range. Deterministic; not thread safe.
///
/// Changes are found with an image 0.24 s earlier. That a pixel shows the ground is decided with images whose
/// distance suits the range: with a short baseline a low obstacle looks like the ground behind it.
class GroundWatch {
 public:
  /// Ground beyond `max_distance_m` from the camera is not compared. std::invalid_argument for bad options.
  GroundWatch(const WorkingCamera& camera, const RigidTransform& vehicle_from_camera, const PolarGrid& grid,
              double max_distance_m, const GroundWatchOptions& options = GroundWatchOptions());
  ~GroundWatch();

  /// Empty vectors if there is no earlier image to compare with, or no ground plane. `image`: CV_8UC1 of the
  /// camera's size. Uses only x, y and yaw of the pose. std::logic_error for an image of another size.
  GroundAppearance compare(Timestamp stamp, const cv::Mat& image, const GroundPlane& ground,
                           const RigidTransform& fixed_from_vehicle);
  /// Compares an image of a camera that stands still with those 0.24 s and up to 3 s earlier, and with the
  /// first one: what differs from any of them has changed. Call clear() when the vehicle has moved.
  /// std::logic_error for an image of another size.
  StandingAppearance compareStanding(Timestamp stamp, const cv::Mat& image);
  /// Drops all earlier images; call it when the poses have jumped.
  void clear();

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace vcharge
