#pragma once

#include <memory>
#include <string>
#include <vector>

#include "initialization/time_offset.h"
#include "vcharge_calibration/initialization/hand_eye.h"
#include "vcharge_calibration/rig/rig_calibration.h"
#include "vcharge_reconstruction/reconstruction_state.h"

namespace vcharge {

/// Thrown if the calibration fails; has the reasons.
struct NotCalibrated {
  std::vector<std::string> remarks;
};

/// Sets length and turns of the drive in `result`. Throws NotCalibrated without odometry or motion.
void describeDrive(const ReconstructionState& state, RigCalibration* result);

/// Initial extrinsics, at height zero, from the motions of each camera and the odometer; also sets
/// the cameras of `result`. If the turns show a time offset, shifts the state's odometry by it.
/// Throws NotCalibrated, with a reason per camera, if there is no solution or if the odometer has wrong
/// signs.
std::shared_ptr<CameraRig> estimateInitialRig(const OdometrySeries& series, const HandEyeOptions& options,
                                              std::vector<std::vector<MotionPair>> motions,
                                              ReconstructionState* state, RigCalibration* result);

/// Estimates the time offset from adjusted keyframes and shifts the state's odometry by it.
void correctTimeOffset(const OdometrySeries& series, ReconstructionState* state, RigCalibration* result);

}  // namespace vcharge
