#pragma once

#include <vector>

#include <opencv2/core.hpp>

#include "vcharge_calibration/boards/calibration_board.h"

namespace vcharge {

/// Moves a corner to the saddle point of the image in a square window (gradients are perpendicular to the
/// lines to it). False, and the pixel stays, where the window leaves the image or the corner would move
/// further than allowed.
bool refineCorner(const cv::Mat& image, double half_window_px, double max_move_px, Eigen::Vector2d* pixel);

/// Moves each corner to the saddle point of the image (gradients are perpendicular to the lines to it). The
/// window follows the board's local spacing in this part of the image, so that it holds as much of the four
/// squares as possible and nothing of other corners. Corners without a neighbour, or that moved further than
/// a third of the spacing, are dropped.
void refineCorners(const cv::Mat& image, const CalibrationBoard& board, std::vector<BoardCorner>* corners);

}  // namespace vcharge
