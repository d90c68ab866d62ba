#pragma once

#include <vector>

#include <opencv2/core.hpp>

#include "vcharge_calibration/boards/calibration_board.h"

namespace vcharge {

/// Moves a corner to the saddle point of the image in a square window, where gradients are perpendicular to
/// the lines to it. Returns false and leaves the pixel unchanged if the window leaves the image or the corner
/// would move too far.
bool refineCorner(const cv::Mat& image, double half_window_px, double max_move_px, Eigen::Vector2d* pixel);

/// Moves each corner to the saddle point of the image. The window adapts to the local spacing of the board,
/// so that it covers as much of the four squares as possible without other corners. Drops corners without a
/// neighbour, or that moved further than a third of the spacing.
void refineCorners(const cv::Mat& image, const CalibrationBoard& board, std::vector<BoardCorner>* corners);

}  // namespace vcharge
