#pragma once

#include <string>
#include <vector>

#include "rig/rig_adjustment.h"
#include "vcharge_calibration/rig/rig_adjustment_options.h"
#include "vcharge_calibration/rig/rig_calibration.h"
#include "vcharge_reconstruction/mapping_state.h"

namespace vcharge {

/// Why a camera's own motions did not give its place, and what to do.
std::string describeFailure(const std::string& camera, const HandEye& initial, const RigCalibration& drive);

/// What contradicts a first guess of the cameras' directions: odometers with a wrong sign turn all of them
/// round, or over. Empty where nothing does.
std::string findWrongSign(const CameraRig& rig);

/// Fills in covariances, statistics and verdict of an adjusted rig.
void judgeRig(const RigAdjustmentOptions& options, const RigPriors& priors, const MappingState& state,
              RigCalibration* result);

/// Verdict and remarks from the figures of a calibration.
void findVerdict(RigCalibration* result);

}  // namespace vcharge
