#pragma once

#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_core/motion/vehicle_footprint.h"

namespace vcharge {

/// Ground under the vehicle and around its outline that no camera in use sees: the cameras' masks, bumpers
/// and the ends of their images hide it.
class HiddenGround {
 public:
  /// Distance from the outline up to which ground may be hidden.
  static constexpr double kReach_m = 1.0;

  /// `is_used`: by camera of the rig; those in use have extrinsics.
  HiddenGround(const CameraRig& rig, const std::vector<bool>& is_used, const VehicleOutline& vehicle);

  /// Whether a point in the vehicle frame (z = 0) is hidden; false beyond kReach_m.
  bool contains(const Eigen::Vector2d& point_in_vehicle_m) const;

 private:
  Eigen::Vector2d min_m_;
  cv::Mat is_hidden_;  // CV_8UC1; columns along x, rows along y
};

}  // namespace vcharge
