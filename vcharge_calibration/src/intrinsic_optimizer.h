#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "vcharge_calibration/chessboard.h"
#include "vcharge_core/camera_model.h"
#include "vcharge_core/rigid_transform.h"

namespace vcharge {

/// A camera with the board's pose in each view.
struct FittedCamera {
  CameraModel model;
  std::vector<RigidTransform> camera_from_board;  ///< one per view
};

/// First guess without any prior focal length: of many, the one with which each view alone fits its board
/// best. The principal point starts in the middle of the image, without distortion. Empty where no view fits.
std::optional<CameraModel> guessCamera(const std::string& model_name, cv::Size image_size_px,
                                       const Chessboard& board, const std::vector<BoardView>& views);

enum class Loss { kSquared, kRobust };

/// Least reprojection error over intrinsics and all poses (Levenberg-Marquardt, exact Schur complement).
/// Empty when it fails. Every view must have a pose with `initial` (boardPose).
std::optional<FittedCamera> fitCamera(const Chessboard& board, const std::vector<BoardView>& views,
                                      const CameraModel& initial, Loss loss);

/// Guess and robust fit in steps: first the views near the middle of the image, where a camera without
/// distortion is about right, then ever more towards the rim. Empty where no camera of the model explains the
/// views.
std::optional<FittedCamera> fitFromScratch(const std::string& model_name, cv::Size image_size_px,
                                           const Chessboard& board, const std::vector<BoardView>& views);

/// Pose of one view with a known camera. Empty when it fails.
std::optional<RigidTransform> fitPose(const Chessboard& board, const BoardView& view,
                                      const CameraModel& model);

/// Covariance of the intrinsics, in the order of parameterNames(), for corners with a standard deviation of
/// `sigma_px` per coordinate; the poses are free. Empty where the views do not determine them.
std::optional<Eigen::MatrixXd> intrinsicsCovariance(const Chessboard& board,
                                                    const std::vector<BoardView>& views,
                                                    const FittedCamera& camera, double sigma_px);

/// Projection of a board's corner minus where it was seen, pixels; NaN where the camera does not see it.
Eigen::Vector2d reprojectionError(const Chessboard& board, const BoardCorner& corner,
                                  const RigidTransform& camera_from_board, const CameraModel& model);

}  // namespace vcharge
