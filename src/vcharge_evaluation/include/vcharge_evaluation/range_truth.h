#pragma once

#include <string>

#include <opencv2/core.hpp>

#include "vcharge_core/base/timestamp.h"
#include "vcharge_core/camera/working_camera.h"

namespace vcharge {

/// Reads FOLDER/<camera>/<stamp_ns>.tiff: CV_32FC1, metres along the ray of each sensor pixel, NaN without a
/// surface. An empty image if the file does not exist; InputError naming the file if it is damaged.
cv::Mat readRangeTruth(const std::string& folder, const std::string& camera_name, Timestamp stamp);

/// True ranges at the pixels of a working camera: CV_32FC1, NaN without a surface. Inverse range is
/// interpolated where the four sensor pixels around agree within 5 %, which is exact on planes for a pinhole;
/// at edges the nearest pixel is taken.
cv::Mat resampleRangeTruth(const cv::Mat& sensor_range_m, const WorkingCamera& working_camera);

}  // namespace vcharge
