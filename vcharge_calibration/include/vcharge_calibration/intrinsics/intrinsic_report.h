#pragma once

#include <string>
#include <vector>

#include "vcharge_calibration/intrinsics/intrinsic_calibration.h"

namespace vcharge {

/// A self-contained HTML page about a calibration: verdict with reasons, parameters with standard deviations,
/// coverage of the image, errors as vectors and as a heat map, undistorted views, and the status of every
/// image. `images` are the images that were calibrated from.
std::string makeIntrinsicReport(const std::string& title, const CalibrationBoard& board,
                                const std::vector<CalibrationImage>& images,
                                const IntrinsicCalibration& result);

}  // namespace vcharge
