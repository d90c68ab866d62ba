#pragma once

#include <opencv2/core.hpp>

namespace vcharge {

/// Mean row of descriptors (1 x columns, CV_32FC1); zero without descriptors.
cv::Mat meanDescriptor(const cv::Mat& descriptors);

/// Converts descriptors (CV_32FC1) to 256 bits each (CV_8UC1 with 32 columns). Each bit says which of two
/// columns is larger relative to its mean. These are signs of sparse random projections: descriptors that
/// differ by an angle a (radians, about the mean) differ in about 256 a / pi bits (Charikar, STOC 2002;
/// Achlioptas, PODS 2001).
cv::Mat binarySignatures(const cv::Mat& descriptors, const cv::Mat& mean);

}  // namespace vcharge
