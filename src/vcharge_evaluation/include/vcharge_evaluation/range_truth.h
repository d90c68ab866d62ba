#pragma once

#include <string>

#include <opencv2/core.hpp>

#include "vcharge_core/base/timestamp.h"
#include "vcharge_core/camera/working_camera.h"

namespace vcharge {

/// Reads FOLDER/<camera>/<stamp_ns>.tiff: metres along the ray of each sensor pixel, NaN where nothing was
/// hit. CV_32FC1. InputError naming the file; an empty image when there is none for this stamp.
cv::Mat readRangeTruth(const std::string& folder, const std::string& camera_name, Timestamp stamp);

/// Truth at the pixels of a working camera. Inside a surface (the four sensor pixels around agree within 5 %)
/// inverse range is interpolated, which is exact on planes for a pinhole and nearly so here; at an edge the
/// nearest pixel decides. NaN where there is none. CV_32FC1 of the working camera's size.
cv::Mat resampleRangeTruth(const cv::Mat& sensor_range_m, const WorkingCamera& working_camera);

}  // namespace vcharge
