#pragma once

#include <memory>
#include <string>
#include <vector>

#include "initialization/time_offset.h"
#include "vcharge_calibration/initialization/hand_eye.h"
#include "vcharge_calibration/rig/rig_calibration.h"
#include "vcharge_reconstruction/reconstruction_state.h"

namespace vcharge {

/// Thrown where the calibration fails, with the reasons.
struct NotCalibrated {
  std::vector<std::string> remarks;
};

/// Sets length and turns of the drive in `result`. NotCalibrated for a drive without odometry or motion.
void describeDrive(const ReconstructionState& state, RigCalibration* result);

/// First guess of the extrinsics, at height zero, from the motions of each camera and the odometer; also sets
/// the cameras of `result`. Where the turns show a time offset, the state's odometry is shifted by it.
/// NotCalibrated, with a reason per camera, where a guess is not possible, or where the odometer has wrong
/// signs.
std::shared_ptr<CameraRig> guessRig(const OdometrySeries& series, const HandEyeOptions& options,
                                    std::vector<std::vector<MotionPair>> motions, ReconstructionState* state,
                                    RigCalibration* result);

/// Estimates the time offset from adjusted keyframes and shifts the state's odometry by it.
void correctTimeOffset(const OdometrySeries& series, ReconstructionState* state, RigCalibration* result);

}  // namespace vcharge
