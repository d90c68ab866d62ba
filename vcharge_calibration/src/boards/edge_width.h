#pragma once

#include <opencv2/core.hpp>

#include "vcharge_calibration/boards/calibration_board.h"
#include "vcharge_core/camera/camera_model.h"

namespace vcharge {

/// Width of the edges between the board's squares in the image: twice the standard deviation of the step's
/// slope, in pixels. The median over the edges along rows or along columns, whichever is wider. About 2 for a
/// sharp image; 0 if nothing could be measured.
double edgeWidth(const cv::Mat& image, const CalibrationBoard& board, const BoardView& view,
                 const PosedBoard& posed, const CameraModel& model);

}  // namespace vcharge
