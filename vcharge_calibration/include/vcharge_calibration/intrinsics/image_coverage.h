#pragma once

#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "vcharge_calibration/boards/calibration_board.h"

namespace vcharge {

/// Parts of the image in which corners were detected, as cells of a coarse grid.
class ImageCoverage {
 public:
  static constexpr int kColumns = 8;
  static constexpr int kRows = 5;

  explicit ImageCoverage(cv::Size image_size_px)
      : size_(image_size_px), counts_(static_cast<size_t>(kColumns) * kRows, 0) {}

  void add(const BoardView& view);
  /// Number of cells that only this view covers.
  int numNewCells(const BoardView& view) const;
  int count(int column, int row) const { return counts_[static_cast<size_t>(row * kColumns + column)]; }
  double coveredFraction() const;
  /// Distance of the farthest corner from the image centre, relative to half of the longer side.
  double reach() const { return reach_; }
  /// Parts of the image's rim without any corner, for example "left" or "upper right".
  std::vector<std::string> missingParts() const;

 private:
  size_t cellOf(const Eigen::Vector2d& pixel) const;

  cv::Size size_;
  std::vector<int> counts_;
  double reach_ = 0.0;
};

}  // namespace vcharge
