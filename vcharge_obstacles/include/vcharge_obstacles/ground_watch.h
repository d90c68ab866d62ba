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

/// Detects ground whose appearance has changed: warps an earlier image of a camera to the current pose with
/// the ground plane and compares the images. Whatever moves or rises above the ground does not match. Motion
/// stereo assumes a static scene and cannot range moving objects, but this comparison needs no range.
/// Deterministic; not thread safe.
class GroundWatch {
 public:
  /// Ground beyond `max_distance_m` from the camera is not compared. std::invalid_argument for bad options.
  GroundWatch(const WorkingCamera& camera, const RigidTransform& vehicle_from_camera, const PolarGrid& grid,
              double max_distance_m, const GroundWatchOptions& options = GroundWatchOptions());
  ~GroundWatch();

  /// Fraction of each cell's ground pixels that have changed, by PolarGrid::index. Empty if there is no
  /// earlier image to compare with, or no ground plane. `image`: CV_8UC1 of the camera's size. Uses only x, y
  /// and yaw of the pose. std::logic_error for an image of another size.
  std::vector<float> compare(Timestamp stamp, const cv::Mat& image, const GroundPlane& ground,
                             const RigidTransform& fixed_from_vehicle);
  /// Drops all earlier images; call it when the poses have jumped.
  void clear();

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace vcharge
