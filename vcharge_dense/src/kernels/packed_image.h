#pragma once

#include <cstdint>

#include <opencv2/core.hpp>

namespace vcharge {

/// An image for bilinear sampling: the cell (x, y) holds the four pixels around a position in [x, x + 1) x
/// [y, y + 1), so that one 32-bit load brings them all. Bytes from the lowest: (x, y), (x, y + 1), (x + 1,
/// y), (x + 1, y + 1), each the gray level less 128, at least -127. A cell with a pixel that is not valid or
/// not in the image is kUnseenCell, and so is a margin around the image.
class PackedImage {
 public:
  static constexpr int kMargin = 32;  ///< cells on every side

  /// pixels and valid_mask: CV_8UC1 of the same size.
  PackedImage(const cv::Mat& pixels, const cv::Mat& valid_mask);

  const int32_t* cells() const { return cells_.ptr<int32_t>(); }
  int pitch() const { return pitch_; }     ///< of rows, in cells
  cv::Size size() const { return size_; }  ///< with the margin

 private:
  cv::Size size_;
  int pitch_;
  cv::Mat cells_;  // CV_32SC1
};

}  // namespace vcharge
