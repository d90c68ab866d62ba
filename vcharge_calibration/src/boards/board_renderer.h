#pragma once

#include <vector>

#include <opencv2/core.hpp>

#include "vcharge_calibration/boards/calibration_board.h"
#include "vcharge_calibration/intrinsics/intrinsic_calibration.h"
#include "vcharge_core/camera/camera_model.h"
#include "vcharge_core/motion/rigid_transform.h"

namespace vcharge {

// Renders images of boards for tests, from the formulas of camera and board and without the calibration's
// code.

/// Range of board poses.
struct PoseRange {
  double max_angle_rad = 1.2;  ///< angle between the axis and the board's middle
  double distance_m = 0.5;
  double min_visible_fraction = 1.0;  ///< fraction of visible corners
};

/// Random poses of a board, tilted and rotated.
std::vector<RigidTransform> boardPoses(const CalibrationBoard& board, const CameraModel& model,
                                       cv::Size image_size_px, int count, const PoseRange& range,
                                       uint32_t seed);

/// Images of a board in front of a gray wall, 3 x 3 rays per pixel, with noise of two gray levels.
std::vector<CalibrationImage> renderBoards(const CalibrationBoard& board, const CameraModel& model,
                                           cv::Size image_size_px, const std::vector<RigidTransform>& poses);

}  // namespace vcharge
