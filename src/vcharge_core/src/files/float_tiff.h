#pragma once

#include <string>

#include <opencv2/core.hpp>

namespace vcharge {

/// Replaces the file only once it is complete. InputError when it cannot be written.
void writeFloatTiff(const cv::Mat& image, const std::string& path);
/// CV_32FC1. InputError naming the file when it is missing or of another type.
cv::Mat readFloatTiff(const std::string& path);

}  // namespace vcharge
