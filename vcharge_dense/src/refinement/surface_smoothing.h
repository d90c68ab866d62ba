#pragma once

#include <opencv2/core.hpp>

#include "kernels/sweep_kernels.h"

namespace vcharge {

/// Values with the unknown ones (NaN) filled from the mean of the smallest block of pixels around each that
/// knows any; NaN only where nothing is known. CV_32FC1.
cv::Mat fillUnknown(const cv::Mat& values);

/// A surface without outliers and plane steps: the median of 5 x 5 pixels, then the mean of those neighbours
/// that lie within one step of it. CV_32FC1; step: per pixel.
cv::Mat smoothSurface(const SweepKernels& kernels, const cv::Mat& inverse_range, const cv::Mat& step);

}  // namespace vcharge
