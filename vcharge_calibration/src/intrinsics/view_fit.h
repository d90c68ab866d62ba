#pragma once

#include <optional>
#include <vector>

#include "intrinsics/intrinsic_optimizer.h"
#include "vcharge_calibration/intrinsics/intrinsic_calibration.h"

namespace vcharge {

/// A camera fitted to consistent views.
struct ViewFit {
  FittedCamera camera;
  FitSettings settings;  ///< settings of the last fit, with the noise of each view
  std::vector<BoardView> views;
  std::vector<double> edge_widths_px;  ///< per view
  std::vector<RejectedImage> rejected;
  double flat_rms_px = 0.0;  ///< RMS error with flat boards
};

/// RMS error of a view per coordinate, in pixels; infinite if the camera does not see a corner.
double rmsError(const CalibrationBoard& board, const BoardView& view, const PosedBoard& posed,
                const CameraModel& model);

double median(const std::vector<double>& values);

/// Fits a camera to views in rounds: detects corners again in the board's plane, removes outliers, and
/// decides whether boards bend. Noisy views have less weight. `images` contains the views' images by name.
/// Empty if the fit fails or fewer than options.min_views remain.
std::optional<ViewFit> fitViews(const CalibrationBoard& board, const std::vector<CalibrationImage>& images,
                                const std::vector<BoardView>& views, const CameraModel& rough,
                                const IntrinsicCalibrationOptions& options);

}  // namespace vcharge
