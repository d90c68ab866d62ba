#pragma once

#include <map>
#include <optional>
#include <utility>
#include <vector>

#include <opencv2/core.hpp>

#include "vcharge_calibration/boards/calibration_board.h"
#include "vcharge_core/camera/camera_model.h"

namespace vcharge {

/// Corners of a chessboard in the image by their position (column, row) on a grid with any origin.
using CornerGrid = std::map<std::pair<int, int>, Eigen::Vector2d>;

/// Extends a part of a board in an image (CV_8UC1), square by square, while there are corners. Returns false
/// and leaves the grid unchanged if the corners are not on a plane.
bool growGrid(const cv::Mat& image, const CameraModel& model, CornerGrid* grid);

/// Converts the grid to corners of the board. Empty if the board fits in no or several positions, or if the
/// grid continues outside of it, so that the board is larger.
std::optional<std::vector<BoardCorner>> boardOnGrid(const CornerGrid& grid, const CalibrationBoard& board);

}  // namespace vcharge
