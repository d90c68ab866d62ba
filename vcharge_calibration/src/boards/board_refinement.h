#pragma once

#include <optional>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "vcharge_calibration/boards/calibration_board.h"
#include "vcharge_core/camera/camera_model.h"

namespace vcharge {

/// Refines corners of a board to sub-pixel accuracy, given approximate camera and board pose. The image
/// around a corner is resampled in the board's plane, where its edges are straight and perpendicular
/// regardless of the lens: the window covers half of each adjacent square, equally for near and far, tilted
/// and distorted squares. The corner is the point to which all gradients are perpendicular; camera and pose
/// only determine the local deformation, not the position.
class BoardRefiner {
 public:
  /// `image` is CV_8UC1. References must outlive this object.
  BoardRefiner(const cv::Mat& image, const CalibrationBoard& board, const CameraModel& model,
               const PosedBoard& posed);

  /// Refines corner `index` near `start`. Empty if the window leaves the image, the corner would move further
  /// than `max_move_px`, or the quarters around it are not alternately black and white.
  std::optional<Eigen::Vector2d> refine(int index, const Eigen::Vector2d& start, double max_move_px) const;
  /// Pixel of a corner according to camera and pose. Empty if the camera does not see it.
  std::optional<Eigen::Vector2d> predict(int index) const;

 private:
  struct Patch;
  std::optional<Patch> cut(int index, double half_m) const;

  const cv::Mat image_;  // float
  const CalibrationBoard& board_;
  const CameraModel& model_;
  const PosedBoard& posed_;
};

}  // namespace vcharge
