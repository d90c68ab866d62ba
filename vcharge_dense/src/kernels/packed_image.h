#pragma once

#include <cstdint>

#include <opencv2/core.hpp>

namespace vcharge {

/// An image for bilinear sampling: cell (x, y) holds the four pixels around positions in [x, x + 1) x
/// [y, y + 1), so that one 32-bit load reads them all. Bytes from the lowest: (x, y), (x, y + 1), (x + 1, y),
/// (x + 1, y + 1), each the gray level minus 128 and at least -127. Cells with an invalid pixel or one
/// outside the image are kUnseenCell, as is a margin around the image.
class PackedImage {
 public:
  static constexpr int kMargin = 32;  ///< number of cells on each side

  /// `pixels` and `valid_mask`: CV_8UC1 of one size.
  PackedImage(const cv::Mat& pixels, const cv::Mat& valid_mask);

  const int32_t* cells() const { return cells_.ptr<int32_t>(); }
  int pitch() const { return pitch_; }     ///< number of cells from one row to the next
  cv::Size size() const { return size_; }  ///< including the margin

 private:
  cv::Size size_;
  int pitch_;
  cv::Mat cells_;  // CV_32SC1
};

}  // namespace vcharge
