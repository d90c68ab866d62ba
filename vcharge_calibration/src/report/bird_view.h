#pragma once

#include <limits>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "vcharge_core/camera/camera_rig.h"

namespace vcharge {

/// Part of the ground around the vehicle, in its frame.
struct BirdViewArea {
  double front_m = 12.0, rear_m = 9.0, side_m = 9.0;
  double metres_per_px = 0.04;
};

/// The rig's images of one instant projected to the ground plane z = 0: x upwards, y to the left; CV_8UC3.
/// Each point comes from the camera whose axis is closest. Thin lines mark the seams, across which structures
/// continue if the extrinsics are correct. Images may be smaller than the cameras' (empty: missing). Unseen
/// ground is black. std::logic_error for a rig without extrinsics.
cv::Mat makeBirdView(const CameraRig& rig, const std::vector<cv::Mat>& images, const BirdViewArea& area);

/// Covariance (x, y, m^2) of a ground point projected from a camera, by the covariance of vehicle_from_camera
/// ([dt, dphi]).
Eigen::Matrix2d groundCovariance(const RigidTransform& vehicle_from_camera,
                                 const Eigen::Matrix<double, 6, 6>& covariance,
                                 const Eigen::Vector2d& ground_m);

/// Two neighbouring cameras at a ground point between them.
struct SeamPoint {
  size_t first = 0, second = 0;  ///< indices of the cameras
  double distance_m = 0.0;       ///< distance from the middle between the two cameras
  Eigen::Vector2d ground_m = Eigen::Vector2d::Zero();
  bool is_seen = false;  ///< both cameras see the point
  /// Standard deviation, in the worse direction, of the distance between the two projections of the point. An
  /// upper bound: errors are assumed independent, but those of height and tilt are mostly common to both.
  double sigma_m = std::numeric_limits<double>::quiet_NaN();
  double before_m = std::numeric_limits<double>::quiet_NaN();  ///< for the initial rig
};

/// Points on the seams of all pairs of neighbours at each of these distances. `before` may be null.
std::vector<SeamPoint> seamPoints(const CameraRig& rig, const CameraRig* before,
                                  const std::vector<double>& distances_m);

}  // namespace vcharge
