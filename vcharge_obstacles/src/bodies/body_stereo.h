#pragma once

#include <optional>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "bodies/body_match.h"
#include "points/panorama.h"

namespace vcharge {

/// What one camera sees at one stamp.
struct PanoramaView {
  const Panorama& panorama;
  const cv::Mat& image;  ///< of the panorama
  Eigen::Vector3d camera_in_vehicle_m;
};

/// A range that two cameras measure.
struct StereoRange {
  double range_m = 0.0;  ///< horizontal, from the first camera
  double sigma_m = 0.0;
};

/// The range of an upright body from one instant of two cameras: the part of the first panorama that shows it
/// is compared with the second one at each range near the expected one. `expected` is seen from the first
/// camera. Right on what moves, and without any motion of the vehicle. None if a camera does not see the
/// body, if nothing correlates, or if another range does nearly as well.
std::optional<StereoRange> matchBodyRange(const PanoramaView& first, const PanoramaView& second,
                                          const BodyBearing& expected, double body_height_m);

}  // namespace vcharge
