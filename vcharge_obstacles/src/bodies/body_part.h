#pragma once

#include <algorithm>

#include <opencv2/core.hpp>

namespace vcharge {

/// Whether a part of an image has enough texture to be compared.
inline bool hasTexture(const cv::Mat& part) {
  constexpr double kTexture = 3.0;  // standard deviation in gray levels
  cv::Scalar mean, deviation;
  cv::meanStdDev(part, mean, deviation);
  return deviation[0] >= kTexture;
}

/// Where between the neighbours of the largest of equally spaced scores their maximum lies, by a parabola: at
/// most half a step to either side.
inline double peakOffset(double before, double peak, double after) {
  const double curvature = before - 2.0 * peak + after;
  return curvature < 0.0 ? std::clamp(0.5 * (before - after) / curvature, -0.5, 0.5) : 0.0;
}

}  // namespace vcharge
