#pragma once

#include <opencv2/core.hpp>

#include "vcharge_calibration/intrinsics/view_collector.h"

namespace vcharge {

/// The image (CV_8UC1) with the board's corners as rings, the corners of all views taken as dots, and the
/// parts of the image that no view shows darkened.
cv::Mat drawCollected(const cv::Mat& image, const ViewCollector& collector);

}  // namespace vcharge
