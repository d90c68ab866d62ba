#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "vcharge_calibration/boards/calibration_board.h"
#include "vcharge_core/camera/camera_model.h"

namespace vcharge {

/// Detects a chessboard or an AprilGrid in fisheye images. Immutable, thread safe.
class BoardDetector {
 public:
  explicit BoardDetector(const CalibrationBoard& board) : board_(board) {}

  /// Detects a complete board without a camera model, using two detectors at two scales. `image` is CV_8UC1.
  std::optional<BoardView> detect(const cv::Mat& image) const;

  /// Detects a board with an approximate camera model: pinhole views of the image in many directions show the
  /// board without distortion, up to the rim. If a view contains only a part of the board, the rest is
  /// predicted and verified corner by corner. Boards with an uncertain outline are not returned. Four tags of
  /// an AprilGrid suffice.
  std::optional<BoardView> detect(const cv::Mat& image, const CameraModel& model) const;

  /// Finds, with the camera model, boards of which a part is detected in the image itself; takes tenths of a
  /// second instead of seconds.
  std::optional<BoardView> detectQuickly(const cv::Mat& image, const CameraModel& model) const;

  /// Describes what the image shows instead of the board, for example "a chessboard of 8x6 inner corners" or
  /// "the board mirrored". Empty if nothing similar is visible.
  std::string describeOther(const cv::Mat& image) const;

 private:
  std::optional<BoardView> growPart(
      const cv::Mat& image, const CameraModel& model, cv::Size part,
      const std::optional<std::vector<cv::Point2f>>& points,
      const std::function<bool(const cv::Point2f&, Eigen::Vector2d*)>& toImage) const;

  CalibrationBoard board_;
};

}  // namespace vcharge
