#pragma once

#include <cstdint>

#include <opencv2/core.hpp>

namespace vcharge {

inline constexpr int kNumClothPatterns = 6;

/// Reflectance of cloth (CV_8UC1): plain weave, stripes across, stripes along, checks, dots or a large print.
/// `tone` is the reflectance of the ground colour.
cv::Mat drawCloth(int pattern, double tone, uint32_t seed);

}  // namespace vcharge
