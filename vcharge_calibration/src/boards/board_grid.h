#pragma once

#include <map>
#include <optional>
#include <utility>
#include <vector>

#include <opencv2/core.hpp>

#include "vcharge_calibration/boards/calibration_board.h"
#include "vcharge_core/camera/camera_model.h"

namespace vcharge {

/// Corners of a chessboard in the image by their place (column, row) on a grid whose origin is anywhere on
/// it.
using CornerGrid = std::map<std::pair<int, int>, Eigen::Vector2d>;

/// Grows a part of a board in an image (CV_8UC1), square by square, as far as there are corners. False, and
/// the grid stays, when the corners do not lie on a plane.
bool growGrid(const cv::Mat& image, const CameraModel& model, CornerGrid* grid);

/// The grid as corners of the board, by index; nothing where the board fits on it in no place or in several,
/// or where the grid goes on beyond it: that is a larger board.
std::optional<std::vector<BoardCorner>> boardOnGrid(const CornerGrid& grid, const CalibrationBoard& board);

}  // namespace vcharge
