#pragma once

#include <string>
#include <vector>

#include "rig/rig_adjustment.h"
#include "vcharge_calibration/rig/rig_adjustment_options.h"
#include "vcharge_calibration/rig/rig_calibration.h"
#include "vcharge_reconstruction/reconstruction_state.h"

namespace vcharge {

/// Reason why the motions of a camera did not give its extrinsics, and a remedy.
std::string describeFailure(const std::string& camera, const HandEye& initial, const RigCalibration& drive);

/// Reason why initial extrinsics are implausible: an odometer with wrong sign turns all cameras backwards or
/// upside down, and cameras named front, left, rear or right look elsewhere if they are swapped. Empty if
/// they are plausible.
std::string findWrongSign(const CameraRig& rig);

/// Sets covariances, statistics and verdict of an adjusted rig.
void judgeRig(const RigAdjustmentOptions& options, const RigPriors& priors, const ReconstructionState& state,
              RigCalibration* result);

/// Sets verdict and remarks from the other fields.
void findVerdict(RigCalibration* result);

}  // namespace vcharge
