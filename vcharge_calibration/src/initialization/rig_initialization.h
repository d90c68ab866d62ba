#pragma once

#include <memory>
#include <string>
#include <vector>

#include "initialization/time_offset.h"
#include "vcharge_calibration/initialization/hand_eye.h"
#include "vcharge_calibration/rig/rig_calibration.h"
#include "vcharge_reconstruction/mapping_state.h"

namespace vcharge {

/// Thrown where nothing can be calibrated, with the verdict's reasons.
struct NotCalibrated {
  std::vector<std::string> remarks;
};

/// Length and turns of the drive into `result`. NotCalibrated for one that has no odometry, or stands.
void describeDrive(const MappingState& state, RigCalibration* result);

/// The first guess of every camera's place, at height zero, from its motions and the odometer's; into the
/// cameras of `result` too. Where the turns show that the odometer's stamps are off, the state's odometry is
/// shifted by that. NotCalibrated, with a reason per camera, where one cannot be told, or where the
/// odometer's signs are wrong.
std::shared_ptr<CameraRig> guessRig(const OdometrySeries& series, const HandEyeOptions& options,
                                    std::vector<std::vector<MotionPair>> motions, MappingState* state,
                                    RigCalibration* result);

/// Finds a time offset anew from adjusted keyframes, and shifts the state's odometry by it.
void correctTimeOffset(const OdometrySeries& series, MappingState* state, RigCalibration* result);

}  // namespace vcharge
