#pragma once

#include "vcharge_calibration/intrinsics/intrinsic_calibration.h"

namespace vcharge {

/// Sets verdict and remarks of an intrinsic calibration from its other fields; removes the model for kFail.
void judgeCalibration(const IntrinsicCalibrationOptions& options, IntrinsicCalibration* result);

}  // namespace vcharge
