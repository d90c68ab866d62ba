#pragma once

#include <optional>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "points/panorama.h"

namespace vcharge {

/// Where the middle of an upright body is, as one camera sees it: azimuth in the vehicle's axes, and
/// horizontal distance.
struct BodyBearing {
  double azimuth_rad = 0.0, range_m = 0.0;
};

/// The bearing of a position from a camera, both in the vehicle's axes.
BodyBearing bearingFrom(const Eigen::Vector2d& camera_m, const Eigen::Vector2d& position_m);

struct BodyMatch {
  double shift_rad = 0.0;    ///< azimuth beyond the expected one
  double correlation = 0.0;  ///< normalized, at most 1
};

/// Finds an upright body again: the part of the earlier panorama that shows it, resized to the expected
/// distance, is moved along the horizon of the later one, within `search_rad` of where it is expected. A
/// whole body is matched where its clothes have no corners to follow. The camera is `camera_height_m` above
/// the ground. None if a part of the body or of the searched ground is not visible, or the body has no
/// texture.
std::optional<BodyMatch> matchBody(const Panorama& panorama, const cv::Mat& before, const cv::Mat& now,
                                   const BodyBearing& seen_before, const BodyBearing& expected_now,
                                   double camera_height_m, double body_height_m, double search_rad);

}  // namespace vcharge
