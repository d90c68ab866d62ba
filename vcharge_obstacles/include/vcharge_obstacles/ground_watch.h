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
  double interval_s = 0.24;           ///< between the images that are compared, as near as they come
  double max_interval_s = 1.0;        ///< images further apart are not compared
  double max_distance_m = 7.0;        ///< from the camera; ground further away is not compared
  double min_difference = 7.0;        ///< gray levels; less is noise
  double relative_difference = 0.05;  ///< of the brightness; less is noise, too
  int slack_px = 1;                   ///< the warp may err by so much

  template <class Visitor>
  void visitFields(Visitor&& visit) {
    visit("interval_s", interval_s);
    visit("max_interval_s", max_interval_s);
    visit("max_distance_m", max_distance_m);
    visit("min_difference", min_difference);
    visit("relative_difference", relative_difference);
    visit("slack_px", slack_px);
  }
  void validate() const;  ///< throws std::invalid_argument naming the field
};

/// Whether the ground still looks as it did: warps an earlier image of a camera by the plane of the ground
/// into the present one and compares them. What moves, or rises above the ground, does not match; unlike
/// motion stereo, which takes for static what it ranges, this needs no range. Deterministic; not thread safe.
class GroundWatch {
 public:
  /// std::invalid_argument for bad options.
  GroundWatch(const WorkingCamera& camera, const RigidTransform& vehicle_from_camera, const PolarGrid& grid,
              const GroundWatchOptions& options = GroundWatchOptions());
  ~GroundWatch();

  /// Share of the pixels that would show a cell's ground and look otherwise than it did, by PolarGrid::index.
  /// Empty where there is nothing to compare with, or no ground plane. `image`: CV_8UC1 of the camera's size;
  /// of the pose, x, y and yaw are used. std::logic_error for an image of another size.
  std::vector<float> compare(Timestamp stamp, const cv::Mat& image, const GroundPlane& ground,
                             const RigidTransform& fixed_from_vehicle);
  /// Forgets all images: poses have jumped.
  void clear();

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace vcharge
