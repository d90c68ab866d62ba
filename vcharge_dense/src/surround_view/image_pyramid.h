#pragma once

#include <array>
#include <cstdint>

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

namespace vcharge {

/// An image and its halves, each the mean of blocks of two by two pixels, below one another in one buffer, so
/// that a single offset names a pixel of any level.
class ImagePyramid {
 public:
  static constexpr int kNumLevels = 4;

  explicit ImagePyramid(cv::Size size) {
    int row = 0;
    for (int level = 0; level < kNumLevels; ++level) {
      levels_[static_cast<size_t>(level)] = {0, row, size.width >> level, size.height >> level};
      row += size.height >> level;
    }
    buffer_ = cv::Mat(row, size.width, CV_8UC1, cv::Scalar(0));
  }

  /// Copies an image of the pyramid's size and computes its halves.
  void set(const cv::Mat& image) {
    image.copyTo(buffer_(rect(0)));
    for (int level = 1; level < kNumLevels; ++level) {
      const cv::Rect& finer = rect(level - 1);
      const cv::Rect even(finer.x, finer.y, finer.width & ~1, finer.height & ~1);
      cv::Mat half = buffer_(rect(level));
      cv::resize(buffer_(even), half, half.size(), 0.0, 0.0, cv::INTER_AREA);
    }
  }

  int stride() const { return static_cast<int>(buffer_.step); }
  const uint8_t* pixels() const { return buffer_.data; }
  const cv::Rect& rect(int level) const { return levels_[static_cast<size_t>(level)]; }
  cv::Mat level(int level) const { return buffer_(rect(level)); }

 private:
  std::array<cv::Rect, kNumLevels> levels_;
  cv::Mat buffer_;
};

}  // namespace vcharge
