#pragma once

#include <optional>

#include <opencv2/core.hpp>

#include "vcharge_calibration/chessboard.h"
#include "vcharge_core/camera_model.h"

namespace vcharge {

/// Finds a chessboard in fisheye images. Immutable, thread safe.
class BoardDetector {
 public:
  explicit BoardDetector(const Chessboard& board) : board_(board) {}

  /// The whole board, without knowing the camera: at several scales of the image. `image` is CV_8UC1.
  std::optional<BoardView> detect(const cv::Mat& image) const;

  /// With a camera model that is about right: pinhole views of the image in many directions, up to the rim,
  /// show the board undistorted; where a view holds only a part of it, the rest is predicted and checked
  /// corner by corner. Boards whose outline is not certain are not returned.
  std::optional<BoardView> detect(const cv::Mat& image, const CameraModel& model) const;

 private:
  Chessboard board_;
};

}  // namespace vcharge
