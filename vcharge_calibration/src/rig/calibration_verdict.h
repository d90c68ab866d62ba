#pragma once

#include "vcharge_calibration/intrinsics/intrinsic_calibration.h"

namespace vcharge {

/// Sets verdict and remarks of a calibration whose other fields are filled in; takes the model away when the
/// verdict is kFail.
void judgeCalibration(const IntrinsicCalibrationOptions& options, IntrinsicCalibration* result);

}  // namespace vcharge
