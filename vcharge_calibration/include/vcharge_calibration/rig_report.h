#pragma once

#include <string>

#include "vcharge_calibration/rig_calibration.h"
#include "vcharge_mapping/mapping_state.h"

namespace vcharge {

/// A calibration as one HTML page that needs nothing beside it: verdict, every degree of freedom with its
/// standard deviation, the cameras on the vehicle, the path with its loops, errors and times.
std::string makeRigReport(const std::string& title, const RigCalibration& result, const MappingState& state);

}  // namespace vcharge
