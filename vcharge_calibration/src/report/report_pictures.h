#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "vcharge_calibration/boards/calibration_board.h"
#include "vcharge_core/camera/camera_model.h"
#include "vcharge_core/camera/camera_rig.h"

namespace vcharge {

/// A corner and its error (projection minus corner), pixels.
struct CornerError {
  Eigen::Vector2d pixel, error_px;
};

/// Coverage of the image: cells without a corner are red. This and the next two return an <svg> element.
std::string drawCoverage(cv::Size image_size_px, const std::vector<BoardView>& views);
/// Errors as lines, enlarged by `scale`.
std::string drawErrorVectors(cv::Size image_size_px, const std::vector<CornerError>& errors, double scale);
/// RMS error per coordinate in the cells of a grid.
std::string drawErrorMap(cv::Size image_size_px, const std::vector<CornerError>& errors);
/// An <img> element with the picture as embedded JPEG, at most `max_width_px` wide.
std::string embedPicture(const cv::Mat& picture, int max_width_px);
/// The image with a view's corners, numbered at the board's origin.
cv::Mat drawCorners(const cv::Mat& image, const CalibrationBoard& board, const BoardView& view);
/// Pinhole view of a camera's image, which may be smaller than the camera's, turned by camera_from_view.
cv::Mat perspectiveView(const cv::Mat& image, const RigCamera& camera,
                        const Eigen::Matrix3d& camera_from_view, cv::Size size_px, double focal_px);
/// Pinhole view of the image, turned to the right by `yaw_rad`; its field of view is 100 degrees.
cv::Mat undistortedView(const cv::Mat& image, const CameraModel& model, double yaw_rad);

}  // namespace vcharge
