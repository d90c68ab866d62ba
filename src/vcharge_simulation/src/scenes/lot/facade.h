#pragma once

#include <string>

#include <opencv2/core.hpp>

namespace vcharge {

inline constexpr double kFacadeTexelsPerM = 32.0;

/// Front of a house (CV_8UC1): wall, rows of windows with frames and curtains, a door, a sign, dirt.
cv::Mat drawFacade(double width_m, double height_m, const std::string& sign, uint32_t seed);

}  // namespace vcharge
