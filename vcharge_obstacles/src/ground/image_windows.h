#pragma once

#include <cstdint>
#include <vector>

#include <opencv2/core.hpp>

namespace vcharge {

/// Sums over the square windows about the pixels of one row, cut off at the border of the image.
class WindowSums {
 public:
  WindowSums(int columns, int half_px);

  /// Moves on by a row: the columns gain the products of `a` and `b`, and lose those of the row that the
  /// windows leave; null where there is none. With `b` null, the values of `a` alone.
  struct Row {
    const uint8_t* a = nullptr;
    const uint8_t* b = nullptr;
  };
  void add(Row entering, Row leaving);
  /// Sums the columns of each window.
  void slide();
  const int32_t* data() const { return of_window_.data(); }

 private:
  int columns_, half_px_;
  std::vector<int32_t> of_column_, of_window_;  // of_column_: with half_px_ zeros at each end
};

/// Means, variances and correlations of the windows of an image and of older ones (all CV_8UC1 and of one
/// size), row by row from the first. The sums are integers: the result does not depend on the machine.
class ImageWindows {
 public:
  ImageWindows(const cv::Mat& now, std::vector<cv::Mat> before, int half_px);

  void nextRow();
  // One value per column of the current row.
  const float* mean() const { return here_.mean.data(); }
  const float* variance() const { return here_.variance.data(); }
  const float* meanBefore(size_t i) const { return there_[i].mean.data(); }
  const float* varianceBefore(size_t i) const { return there_[i].variance.data(); }
  /// Normalized cross-correlation of the image and an older one, with variances of at least 1.
  const float* correlation(size_t i) const { return pairs_[i].correlation.data(); }

 private:
  struct Moments {
    WindowSums sums, squares;
    std::vector<float> mean, variance;
  };
  struct Pair {
    WindowSums products;
    std::vector<float> correlation;
  };
  void addRow(int entering, int leaving);
  void setMoments(Moments* moments) const;

  const cv::Mat now_;
  const std::vector<cv::Mat> before_;
  const int half_px_;
  int row_ = -1;
  std::vector<int32_t> columns_in_window_, count_;  // pixels of each window of the current row
  Moments here_;
  std::vector<Moments> there_;
  std::vector<Pair> pairs_;
};

}  // namespace vcharge
