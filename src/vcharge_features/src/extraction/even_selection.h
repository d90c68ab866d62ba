#pragma once

#include <vector>

#include <opencv2/core.hpp>

namespace vcharge {

/// Anything that is to be spread over the image.
struct SelectionCandidate {
  cv::Point2f position_px;
  float response = 0.0F;
};

/// Indices of at most `max_count` candidates, spread over a grid of cells laid over an image of `size`: each
/// cell in turn gives its best candidate not yet taken; of the last turn the best remain. Ascending. Ties go
/// to the candidate with the smaller index.
std::vector<int> selectEvenly(const std::vector<SelectionCandidate>& candidates, cv::Size size,
                              int grid_columns, int grid_rows, int max_count);

}  // namespace vcharge
