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

/// A camera and the board in each view.
struct FittedCamera {
  CameraModel model;
  std::vector<PosedBoard> boards;  ///< one per view
};

/// Initial camera without a known focal length: the candidate with which each view alone fits its board best.
/// The principal point is in the middle of the image; without distortion. Empty if no view fits.
std::optional<CameraModel> initialCamera(const std::string& model_name, cv::Size image_size_px,
                                         const CalibrationBoard& board, const std::vector<BoardView>& views);

enum class Loss { kSquared, kRobust };

/// Assumptions of a fit.
struct FitSettings {
  Loss loss = Loss::kSquared;
  double sigma_px = 1.0;          ///< standard deviation of a corner per coordinate
  std::vector<double> sigmas_px;  ///< the same for each view; empty: sigma_px for all
  bool bending = false;           ///< each view's board may bend by some thousandths of its size
};

/// Minimizes the reprojection error over intrinsics and all board poses (Levenberg-Marquardt, exact Schur
/// complement). Empty if it fails. Every view must have a pose with `initial` (boardPose).
std::optional<FittedCamera> fitCamera(const CalibrationBoard& board, const std::vector<BoardView>& views,
                                      const CameraModel& initial, const FitSettings& settings);

/// Initial camera and robust fit in steps: first views near the middle of the image, where a camera without
/// distortion is a good approximation, then further towards the rim. Empty if no camera of the model explains
/// the views.
std::optional<FittedCamera> fitFromScratch(const std::string& model_name, cv::Size image_size_px,
                                           const CalibrationBoard& board,
                                           const std::vector<BoardView>& views);

/// Pose and bending of the board in a view for a known camera. Empty if it fails.
std::optional<PosedBoard> fitBoard(const CalibrationBoard& board, const BoardView& view,
                                   const CameraModel& model, const FitSettings& settings);

/// Covariance of the intrinsics, in the order of parameterNames(), for corners with the standard deviations
/// of the settings and unknown board poses. Empty if the views do not determine them.
std::optional<Eigen::MatrixXd> intrinsicsCovariance(const CalibrationBoard& board,
                                                    const std::vector<BoardView>& views,
                                                    const FittedCamera& camera, const FitSettings& settings);

/// Projection of a board's corner minus its detection, in pixels; NaN if the camera does not see it.
Eigen::Vector2d reprojectionError(const CalibrationBoard& board, const BoardCorner& corner,
                                  const PosedBoard& posed, const CameraModel& model);

}  // namespace vcharge
