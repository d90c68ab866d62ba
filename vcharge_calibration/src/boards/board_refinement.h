#pragma once

#include <optional>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "vcharge_calibration/boards/calibration_board.h"
#include "vcharge_core/camera/camera_model.h"

namespace vcharge {

/// Finds the corners of a board to sub-pixel accuracy where the camera and the board's place are about known.
/// The image around a corner is looked at in the board's plane: there the corner's edges are straight and
/// perpendicular however the lens bends them, so that the window reaches over half of each adjoining square,
/// along x and along y, and is the same for near and far, tilted and distorted squares. The corner is the
/// point to whose lines the gradients are perpendicular; camera and place only say how the neighbourhood is
/// bent, not where it lies.
class BoardRefiner {
 public:
  /// `image` is CV_8UC1. References must outlive this object.
  BoardRefiner(const cv::Mat& image, const CalibrationBoard& board, const CameraModel& model,
               const PlacedBoard& placed);

  /// Corner `index` near `start`. Empty where the window leaves the image, where the corner would move
  /// further than `max_move_px`, and where the quarters around it are not black and white in turns.
  std::optional<Eigen::Vector2d> refine(int index, const Eigen::Vector2d& start, double max_move_px) const;
  /// Where camera and place put a corner. Empty where the camera does not see it.
  std::optional<Eigen::Vector2d> predict(int index) const;

 private:
  struct Patch;
  std::optional<Patch> cut(int index, double half_m) const;

  const cv::Mat image_;  // float
  const CalibrationBoard& board_;
  const CameraModel& model_;
  const PlacedBoard& placed_;
};

}  // namespace vcharge
