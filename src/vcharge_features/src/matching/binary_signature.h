#pragma once

#include <opencv2/core.hpp>

namespace vcharge {

/// Mean row of descriptors (1 x columns, CV_32FC1); zero where there are none.
cv::Mat meanDescriptor(const cv::Mat& descriptors);

/// CV_8UC1 with 32 columns: 256 bits per descriptor (CV_32FC1), each telling which of two of its numbers lies
/// further above their means. Signs of sparse random projections: descriptors at an angle (about the mean)
/// of a radians differ in about 256 a / pi bits (Charikar, STOC 2002; Achlioptas, PODS 2001).
cv::Mat binarySignatures(const cv::Mat& descriptors, const cv::Mat& mean);

}  // namespace vcharge
