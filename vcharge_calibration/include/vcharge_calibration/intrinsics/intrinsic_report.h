#pragma once

#include <string>
#include <vector>

#include "vcharge_calibration/intrinsics/intrinsic_calibration.h"

namespace vcharge {

/// A calibration as one HTML page without any other file: verdict with its reasons, parameters with their
/// standard deviations, where corners were seen, their errors as vectors and as a heat map, undistorted
/// views, and every image with what became of it. `images` are those of the calibration.
std::string makeIntrinsicReport(const std::string& title, const CalibrationBoard& board,
                                const std::vector<CalibrationImage>& images,
                                const IntrinsicCalibration& result);

}  // namespace vcharge
