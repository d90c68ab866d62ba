#pragma once

#include <string>

#include <opencv2/core.hpp>

namespace vcharge {

inline constexpr double kFacadeTexelsPerM = 32.0;

/// Reflectance of a house front (CV_8UC1): wall, rows of windows, a door, an optional sign, dirt.
cv::Mat drawFacade(double width_m, double height_m, const std::string& sign, uint32_t seed);

}  // namespace vcharge
