#pragma once

#include <string>

#include <opencv2/core.hpp>

#include "vcharge_core/base/timestamp.h"
#include "vcharge_core/camera/mei_camera.h"
#include "vcharge_core/files/content_hash.h"

namespace vcharge {

/// Distance along the ray of each pixel of a working camera. The first three images have the same size and
/// are CV_32FC1.
struct RangeMap {
  Timestamp stamp;
  std::string camera_name;
  std::string frame_id;          ///< optical frame of the camera
  MeiCamera camera;              ///< without distortion; pixel -> ray
  cv::Mat range_m;               ///< metres along the ray (not depth along the axis); NaN where unknown
  cv::Mat standard_deviation_m;  ///< one standard deviation of range_m; NaN where unknown
  cv::Mat confidence;            ///< 0 (no support) to 1; 0 where unknown
  cv::Mat reference;             ///< CV_8UC1 of the same size: the camera image; may be empty
};

/// Adds stamp, camera and all pixels except the reference's; all NaNs are equal.
void addToHash(const RangeMap& map, ContentHasher* hasher);

}  // namespace vcharge
