#pragma once

#include <vector>

#include <opencv2/core.hpp>

#include "vcharge_calibration/boards/calibration_board.h"

namespace vcharge {

/// A tag detected in an image: its id and its four corners, in the order of cornersOfTag().
struct SeenTag {
  int id = 0;
  std::vector<cv::Point2f> corners;
};

/// Indices of a tag's corners on an AprilGrid: lower left, lower right, upper right, upper left.
std::vector<int> cornersOfTag(const CalibrationBoard& board, int id);

/// Detects the tags of an AprilGrid with borders of two cells (Kalibr's) or one. Empty if fewer than two
/// neighbours are visible, which determine the orientation, or if the tags are not arranged as on the board.
std::vector<SeenTag> findTags(const cv::Mat& image, const CalibrationBoard& board);

}  // namespace vcharge
