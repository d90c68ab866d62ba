#pragma once

#include <vector>

#include <opencv2/core.hpp>

#include "vcharge_calibration/boards/calibration_board.h"

namespace vcharge {

/// A tag in an image: its place on the board and its four corners, in the order of cornersOfTag().
struct SeenTag {
  int id = 0;
  std::vector<cv::Point2f> corners;
};

/// Indices of a tag's corners on an AprilGrid: lower left, lower right, upper right, upper left.
std::vector<int> cornersOfTag(const CalibrationBoard& board, int id);

/// The tags of an AprilGrid that an image shows, with borders of two cells (Kalibr's) or one. Empty where
/// fewer than two neighbours are seen, which say how tags are turned, and where tags do not lie as on the
/// board.
std::vector<SeenTag> findTags(const cv::Mat& image, const CalibrationBoard& board);

}  // namespace vcharge
