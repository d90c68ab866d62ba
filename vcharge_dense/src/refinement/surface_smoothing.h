#pragma once

#include <opencv2/core.hpp>

#include "kernels/sweep_kernels.h"

namespace vcharge {

/// Fills unknown values (NaN) with the mean of the smallest block of an image pyramid that contains known
/// ones. CV_32FC1; stays NaN only where all values are unknown.
cv::Mat fillUnknown(const cv::Mat& values);

/// Removes outliers and steps between planes: a median of 5 x 5 pixels, then the mean of the neighbours
/// within one step of it. CV_32FC1; `step`: spacing of the planes at each pixel.
cv::Mat smoothSurface(const SweepKernels& kernels, const cv::Mat& inverse_range, const cv::Mat& step);

}  // namespace vcharge
