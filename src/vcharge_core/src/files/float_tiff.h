#pragma once

#include <string>

#include <opencv2/core.hpp>

namespace vcharge {

/// Writes a CV_32FC1 image. Replaces an older file only when the new one is complete. Throws InputError when
/// it cannot be written.
void writeFloatTiff(const cv::Mat& image, const std::string& path);
/// Reads a CV_32FC1 image. Throws InputError naming the file when it is missing or of another type.
cv::Mat readFloatTiff(const std::string& path);

}  // namespace vcharge
