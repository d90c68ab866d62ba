#pragma once

#include <opencv2/core.hpp>

#include "vcharge_calibration/boards/calibration_board.h"
#include "vcharge_core/camera/camera_model.h"

namespace vcharge {

/// How wide the edges between the board's squares are in an image: twice the standard deviation of the step's
/// slope, in pixels, median over the board, of the edges along rows or along columns, whichever are
/// wider. About 2 for a sharp image; 0 where nothing could be measured.
double edgeWidth(const cv::Mat& image, const CalibrationBoard& board, const BoardView& view,
                 const PlacedBoard& placed, const CameraModel& model);

}  // namespace vcharge
