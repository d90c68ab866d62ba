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

/// The ground as the rig's images of one instant show it, taken for a plane at z = 0: x upwards, y to the
/// left; CV_8UC3. Each place comes from the camera that looks most towards it; where that changes is a seam,
/// marked by a thin line: what crosses it is in line where the cameras' places are right. Images may be
/// smaller than the cameras' (empty: none). Black: no camera sees it. std::logic_error for a rig without
/// extrinsics.
cv::Mat makeBirdView(const CameraRig& rig, const std::vector<cv::Mat>& images, const BirdViewArea& area);

/// Where a camera puts a point of the ground that it sees, by how its place is known: covariance (x, y, m^2)
/// by that of vehicle_from_camera ([dt, dphi]).
Eigen::Matrix2d groundCovariance(const RigidTransform& vehicle_from_camera,
                                 const Eigen::Matrix<double, 6, 6>& covariance,
                                 const Eigen::Vector2d& ground_m);

/// Two neighbouring cameras at a place on the ground between them.
struct SeamPoint {
  size_t first = 0, second = 0;  ///< cameras
  double distance_m = 0.0;       ///< from the middle between the two
  Eigen::Vector2d ground_m = Eigen::Vector2d::Zero();
  bool is_seen = false;  ///< by both
  /// Standard deviation, along the worse direction, of how far apart the two show the place; their errors are
  /// taken for independent, though those of height and tilt largely are common and cancel: an upper bound.
  double sigma_m = std::numeric_limits<double>::quiet_NaN();
  double before_m = std::numeric_limits<double>::quiet_NaN();  ///< how far apart they were by the first guess
};

/// At each of these distances for every pair of neighbours. `before` may be null.
std::vector<SeamPoint> seamPoints(const CameraRig& rig, const CameraRig* before,
                                  const std::vector<double>& distances_m);

}  // namespace vcharge
