#pragma once

#include "vcharge_calibration/live/calibration_coach.h"
#include "vcharge_reconstruction/reconstruction_state.h"

namespace vcharge {

/// Passes new keyframes of a drive to a coach, and the motions of the cameras between them as
/// estimateCameraMotions() estimates them from the whole drive.
void updateCoach(const ReconstructionState& state, CalibrationCoach* coach);

}  // namespace vcharge
