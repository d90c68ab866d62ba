#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "vcharge_calibration/boards/calibration_board.h"
#include "vcharge_core/camera/camera_model.h"
#include "vcharge_core/motion/rigid_transform.h"

namespace vcharge {

/// A camera with the board in each view.
struct FittedCamera {
  CameraModel model;
  std::vector<PlacedBoard> boards;  ///< one per view
};

/// First guess without any prior focal length: of many, the one with which each view alone fits its board
/// best. The principal point starts in the middle of the image, without distortion. Empty where no view fits.
std::optional<CameraModel> guessCamera(const std::string& model_name, cv::Size image_size_px,
                                       const CalibrationBoard& board, const std::vector<BoardView>& views);

enum class Loss { kSquared, kRobust };

/// What a fit takes for granted.
struct FitSettings {
  Loss loss = Loss::kSquared;
  double sigma_px = 1.0;          ///< of a corner, per coordinate
  std::vector<double> sigmas_px;  ///< the same per view; empty: sigma_px in all
  bool bending = false;           ///< each view's board may bend, by some thousandths of its size
};

/// Least reprojection error over intrinsics and all boards' places (Levenberg-Marquardt, exact Schur
/// complement). Empty when it fails. Every view must have a pose with `initial` (boardPose).
std::optional<FittedCamera> fitCamera(const CalibrationBoard& board, const std::vector<BoardView>& views,
                                      const CameraModel& initial, const FitSettings& settings);

/// Guess and robust fit in steps: first the views near the middle of the image, where a camera without
/// distortion is about right, then ever more towards the rim. Empty where no camera of the model explains the
/// views.
std::optional<FittedCamera> fitFromScratch(const std::string& model_name, cv::Size image_size_px,
                                           const CalibrationBoard& board,
                                           const std::vector<BoardView>& views);

/// Place of the board in one view with a known camera. Empty when it fails.
std::optional<PlacedBoard> fitBoard(const CalibrationBoard& board, const BoardView& view,
                                    const CameraModel& model, const FitSettings& settings);

/// Covariance of the intrinsics, in the order of parameterNames(), for corners with the settings' standard
/// deviations; the boards are free. Empty where the views do not determine them.
std::optional<Eigen::MatrixXd> intrinsicsCovariance(const CalibrationBoard& board,
                                                    const std::vector<BoardView>& views,
                                                    const FittedCamera& camera, const FitSettings& settings);

/// Projection of a board's corner minus where it was seen, pixels; NaN where the camera does not see it.
Eigen::Vector2d reprojectionError(const CalibrationBoard& board, const BoardCorner& corner,
                                  const PlacedBoard& placed, const CameraModel& model);

}  // namespace vcharge
