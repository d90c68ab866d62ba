#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "vcharge_calibration/boards/calibration_board.h"
#include "vcharge_core/camera/camera_model.h"

namespace vcharge {

/// Finds a chessboard or an AprilGrid in fisheye images. Immutable, thread safe.
class BoardDetector {
 public:
  explicit BoardDetector(const CalibrationBoard& board) : board_(board) {}

  /// The whole board, without knowing the camera: by two detectors, at two scales of the image. `image` is
  /// CV_8UC1.
  std::optional<BoardView> detect(const cv::Mat& image) const;

  /// With a camera model that is about right: pinhole views of the image in many directions, up to the rim,
  /// show the board undistorted; where a view holds only a part of it, the rest is predicted and checked
  /// corner by corner. Boards whose outline is not certain are not returned. Of an AprilGrid, four tags
  /// suffice.
  std::optional<BoardView> detect(const cv::Mat& image, const CameraModel& model) const;

  /// The same, but for boards of which a part is found in the image itself: tenths of a second where the
  /// other takes seconds.
  std::optional<BoardView> detectQuickly(const cv::Mat& image, const CameraModel& model) const;

  /// What an image shows instead of the board: "a chessboard of 8x6 inner corners", "the board mirrored".
  /// Empty where nothing of the kind is seen.
  std::string describeOther(const cv::Mat& image) const;

 private:
  std::optional<BoardView> growPart(
      const cv::Mat& image, const CameraModel& model, cv::Size part,
      const std::optional<std::vector<cv::Point2f>>& points,
      const std::function<bool(const cv::Point2f&, Eigen::Vector2d*)>& toImage) const;

  CalibrationBoard board_;
};

}  // namespace vcharge
