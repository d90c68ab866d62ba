#pragma once

#include <cstdint>

#include <opencv2/core.hpp>

namespace vcharge {

/// Brightness of a CV_8UC1 image between its pixels. The four around the position must be in the image, whose
/// columns go from 0 to cols - 1: 0 <= x < cols - 1, 0 <= y < rows - 1; that is not checked.
inline float bilinearSample(const cv::Mat& image, float x, float y) {
  const auto column = static_cast<int>(x), row = static_cast<int>(y);
  const float right = x - static_cast<float>(column), low = y - static_cast<float>(row);
  const uint8_t* upper = image.ptr<uint8_t>(row) + column;
  const uint8_t* lower = image.ptr<uint8_t>(row + 1) + column;
  const float above = static_cast<float>(upper[0]) + right * static_cast<float>(upper[1] - upper[0]);
  const float below = static_cast<float>(lower[0]) + right * static_cast<float>(lower[1] - lower[0]);
  return above + low * (below - above);
}

}  // namespace vcharge
