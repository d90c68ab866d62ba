#pragma once

#include <optional>
#include <vector>

#include "intrinsics/intrinsic_optimizer.h"
#include "vcharge_calibration/intrinsics/intrinsic_calibration.h"

namespace vcharge {

/// A camera fitted to the views that belong to it.
struct ViewFit {
  FittedCamera camera;
  FitSettings settings;  ///< the last fit's, with each view's noise
  std::vector<BoardView> views;
  std::vector<double> edge_widths_px;  ///< of the views
  std::vector<RejectedImage> rejected;
  double flat_rms_px = 0.0;  ///< with flat boards
};

/// RMS error of a view per coordinate, pixels; infinite where the camera does not see a corner.
double rmsError(const CalibrationBoard& board, const BoardView& view, const PlacedBoard& placed,
                const CameraModel& model);

double median(const std::vector<double>& values);

/// Fits a camera to views, alternately finding the corners anew in the board's plane, leaving out what does
/// not belong, and deciding whether boards bend. Noisy views weigh less. `images` has the views' images by
/// name. Empty where the fit fails or fewer than options.min_views are left.
std::optional<ViewFit> fitViews(const CalibrationBoard& board, const std::vector<CalibrationImage>& images,
                                const std::vector<BoardView>& views, const CameraModel& rough,
                                const IntrinsicCalibrationOptions& options);

}  // namespace vcharge
