#pragma once

#include <array>
#include <vector>

#include <opencv2/core.hpp>

namespace vcharge {

/// Linear classifier of people over histograms of oriented gradients (Dalal and Triggs, "Histograms of
/// Oriented Gradients for Human Detection", CVPR 2005): the descriptor and the weights of OpenCV's
/// HOGDescriptor, whose scores it gives in a fraction of the time. Immutable.
class PeopleClassifier {
 public:
  /// A window shows a person of about three quarters of its height. Windows are this far apart.
  static constexpr int kWidth_px = 64, kHeight_px = 128, kStep_px = 8;

  PeopleClassifier();

  /// Scores (CV_32FC1) of the windows of an image (CV_32FC1, square roots of gray levels): signed distances
  /// from the border between people and all else. std::logic_error for an image smaller than a window.
  cv::Mat scores(const cv::Mat& roots) const;

 private:
  static constexpr int kBins = 9, kBlock_px = 16;
  static constexpr int kPerBlock = 4 * kBins;
  using CellWeights = std::array<std::array<float, kBlock_px>, 2>;

  /// Histograms of all blocks (rows of kPerBlock values), normalized.
  cv::Mat blocks(const cv::Mat& roots) const;
  void addPixels(const float* strength, const float* direction_rad, int columns, float* histograms) const;
  void addRow(const float* histograms, int columns, int y, float* blocks) const;

  const CellWeights weights_;         // of the pixels along one axis of a block, for each of two cells
  std::vector<float> by_window_row_;  // the classifier's weights: by row and column of blocks
  float offset_ = 0.0F;
};

}  // namespace vcharge
