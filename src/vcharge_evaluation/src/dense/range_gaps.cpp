#include "vcharge_evaluation/range_gaps.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace vcharge {

void RangeGaps::add(const cv::Mat& range_m, const cv::Mat& truth_m, const cv::Mat& valid) {
  if (truth_m.size() != range_m.size() || valid.size() != range_m.size()) {
    throw std::logic_error("RangeGaps: truth, mask and range map differ in size");
  }
  const cv::Size size = range_m.size() / kCellPx;
  if (gap_.empty()) {
    gap_ = cv::Mat::zeros(size, CV_32S);
    longest_ = cv::Mat(size, CV_32S, cv::Scalar(-1));
  }
  for (int row = 0; row < size.height; ++row) {
    for (int column = 0; column < size.width; ++column) {
      int num_near = 0;
      int num_known = 0;
      for (int y = row * kCellPx; y < (row + 1) * kCellPx; ++y) {
        for (int x = column * kCellPx; x < (column + 1) * kCellPx; ++x) {
          if (valid.at<uchar>(y, x) != 0 && truth_m.at<float>(y, x) < kNearM) {
            ++num_near;
            num_known += std::isfinite(range_m.at<float>(y, x)) ? 1 : 0;
          }
        }
      }
      int& gap = gap_.at<int>(row, column);
      int& longest = longest_.at<int>(row, column);
      if (2 * num_near < kCellPx * kCellPx) {
        gap = 0;
        continue;
      }
      const bool known = 4 * num_known >= num_near;
      ++num_near_;
      num_known_ += known ? 1 : 0;
      gap = known ? 0 : gap + 1;
      longest = std::max(longest, gap);
    }
  }
}

RangeGapCounts RangeGaps::counts() const {
  RangeGapCounts counts;
  for (int row = 0; row < longest_.rows; ++row) {
    for (int column = 0; column < longest_.cols; ++column) {
      const int longest = longest_.at<int>(row, column);
      counts.num_cells += longest >= 0 ? 1 : 0;
      counts.num_gap_cells += longest > kLongestGap ? 1 : 0;
      counts.longest_gap = std::max(counts.longest_gap, longest);
    }
  }
  counts.fraction_known =
      num_near_ == 0 ? 0.0 : static_cast<double>(num_known_) / static_cast<double>(num_near_);
  return counts;
}

}  // namespace vcharge
