#pragma once

#include <cstddef>

#include <opencv2/core.hpp>

namespace vcharge {

/// How long what is near stays without ranges. Cells are blocks of 8 x 8 pixels of the working image.
struct RangeGapCounts {
  size_t num_cells = 0;  ///< cells with a near surface in some range map
  size_t num_gap_cells =
      0;  ///< those that were near and unknown in more than `kLongestGap` range maps on end
  double fraction_known = 0.0;  ///< part of all near cells of all range maps
  int longest_gap = 0;          ///< in range maps
};

/// Follows the cells of one camera over its range maps.
class RangeGaps {
 public:
  static constexpr int kCellPx = 8;
  static constexpr float kNearM = 4.0F;
  static constexpr int kLongestGap = 5;

  /// range_m is a RangeMap's; truth_m and valid as RangeEvaluator takes them. A cell is near where at least
  /// half of its pixels are valid and truly nearer than `kNearM`, and unknown where fewer than a quarter of
  /// these have a range.
  void add(const cv::Mat& range_m, const cv::Mat& truth_m, const cv::Mat& valid);

  RangeGapCounts counts() const;

 private:
  cv::Mat gap_;      // CV_32S per cell: range maps since the last known one, 0 where it isn't near
  cv::Mat longest_;  // CV_32S per cell; -1: never near
  size_t num_near_ = 0;
  size_t num_known_ = 0;
};

}  // namespace vcharge
