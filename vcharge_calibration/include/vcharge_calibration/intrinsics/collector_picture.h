#pragma once

#include <opencv2/core.hpp>

#include "vcharge_calibration/intrinsics/view_collector.h"

namespace vcharge {

/// The image (CV_8UC1) with rings at the board's corners and dots at the corners of all collected views;
/// regions without any view are darkened.
cv::Mat drawCollected(const cv::Mat& image, const ViewCollector& collector);

}  // namespace vcharge
