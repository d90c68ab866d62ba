#pragma once

#include <string>

#include "vcharge_calibration/rig_calibration.h"

namespace vcharge {

/// The drive, every camera's degrees of freedom with their standard deviations, and what is known least, as
/// lines of text; without verdict and remarks.
std::string describeCalibration(const RigCalibration& result);

}  // namespace vcharge
