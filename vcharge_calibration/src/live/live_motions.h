#pragma once

#include "vcharge_calibration/live/calibration_coach.h"
#include "vcharge_reconstruction/reconstruction_state.h"

namespace vcharge {

/// Passes new keyframes of a drive to a coach, and the cameras' motions between them, estimated as in
/// estimateCameraMotions().
void updateCoach(const ReconstructionState& state, CalibrationCoach* coach);

}  // namespace vcharge
