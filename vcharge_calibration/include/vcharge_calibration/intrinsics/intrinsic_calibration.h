#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "vcharge_calibration/boards/calibration_board.h"
#include "vcharge_core/base/options.h"
#include "vcharge_core/camera/camera_model.h"

namespace vcharge {

/// Options of calibrateIntrinsics().
struct IntrinsicCalibrationOptions {
  VCHARGE_BEGIN_OPTIONS(IntrinsicCalibrationOptions);
  VCHARGE_OPTION(std::string, model, "mei", anyValue(), "Camera model: mei, kannala_brandt or pinhole.");
  VCHARGE_OPTION(int, min_views, 5, atLeast(3), "Smallest number of images with a board.");
  VCHARGE_END_OPTIONS();
  void checkFields() const { CameraModel::parameterNames(model); }
};

/// A gray image to calibrate from.
struct CalibrationImage {
  std::string name;
  cv::Mat pixels;  ///< CV_8UC1
};

/// A view used by the calibration.
struct CalibratedView {
  BoardView view;
  PosedBoard posed;
  double rms_px = 0.0;  ///< RMS error per coordinate
  double edge_width_px = 0.0;
};

/// An image not used by the calibration, and the reason.
struct RejectedImage {
  std::string name, reason;
};

enum class Verdict { kPass, kWarn, kFail };
/// "PASS", "WARN", "FAIL".
std::string toString(Verdict verdict);

/// Result of calibrateIntrinsics(). Without a model if the verdict is kFail.
struct IntrinsicCalibration {
  Verdict verdict = Verdict::kFail;
  std::vector<std::string> remarks;  ///< reasons of the verdict, and what the images lack
  cv::Size image_size_px;
  std::optional<CameraModel> model;
  /// Standard deviations of the model's parameters, in their order, for errors that are correlated within a
  /// view (jackknife).
  Eigen::VectorXd standard_deviations;
  /// The same of the image 45 degrees from the axis: of its size, relative, and of the principal point. The
  /// parameters themselves are uncertain where one can make up for another.
  double focal_sigma = 0.0, principal_point_sigma_px = 0.0;
  std::vector<CalibratedView> views;
  std::vector<RejectedImage> rejected;
  double rms_px = 0.0;              ///< RMS error per coordinate
  double mean_error_px = 0.0;       ///< mean distance between projection and corner
  double flat_rms_px = 0.0;         ///< rms_px of a fit with flat boards
  bool bent_boards = false;         ///< boards bend, and the fit models it
  double bending_m = 0.0;           ///< RMS of the boards' bending along their longer side
  double cross_validated_px = 0.0;  ///< RMS per coordinate of views that were excluded from the fit
  double covered_fraction = 0.0;    ///< fraction of the image's cells in which corners were detected
  double max_angle_rad = 0.0;       ///< angle of the farthest corner from the axis
};

/// Calibrates a camera from images of a board: detects the boards, estimates a first camera, detects further
/// boards with it, fits the camera, removes outliers with a reason, and judges the result. `progress`
/// receives the completed fraction; calls are never concurrent. Throws InputError for images of different
/// sizes. Deterministic.
IntrinsicCalibration calibrateIntrinsics(const CalibrationBoard& board,
                                         const std::vector<CalibrationImage>& images,
                                         const IntrinsicCalibrationOptions& options,
                                         const std::function<void(double)>& progress);

}  // namespace vcharge
