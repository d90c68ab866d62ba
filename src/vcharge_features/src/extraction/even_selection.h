#pragma once

#include <vector>

#include <opencv2/core.hpp>

namespace vcharge {

/// The grid of the extractors. Much finer grids spread features more evenly, but select weaker ones that
/// match worse.
constexpr int kGridColumns = 4;
constexpr int kGridRows = 3;

/// A feature that may be selected.
struct SelectionCandidate {
  cv::Point2f position_px;
  float response = 0.0F;
};

/// Selects at most `max_count` candidates, spread over a grid of cells in an image of `size`: in rounds, each
/// cell contributes its best remaining candidate; in the last round, only the best of these are kept. Returns
/// indices in ascending order. Ties go to the smaller index.
std::vector<int> selectEvenly(const std::vector<SelectionCandidate>& candidates, cv::Size size,
                              int grid_columns, int grid_rows, int max_count);

}  // namespace vcharge
