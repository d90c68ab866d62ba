#pragma once

#include <optional>
#include <string>

#include "ground.h"
#include "vcharge_calibration/rig_calibration.h"
#include "vcharge_calibration/rig_calibrator_options.h"
#include "vcharge_core/text_format.h"
#include "vcharge_mapping/mapping_state.h"

namespace vcharge {

/// Why a camera's own motions did not give its place, and what to do.
std::string describeFailure(const std::string& camera, const HandEye& initial, const RigCalibration& drive);

/// Fills in covariances, statistics and verdict of an adjusted rig.
void judgeRig(const RigCalibratorOptions& options, const MappingState& state,
              const std::optional<GroundPlane>& ground, RigCalibration* result);

}  // namespace vcharge
