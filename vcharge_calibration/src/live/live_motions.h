#pragma once

#include <cstddef>

#include "vcharge_calibration/live/calibration_coach.h"
#include "vcharge_geometry/robust/robust_options.h"
#include "vcharge_reconstruction/mapping_state.h"

namespace vcharge {

/// Tells a coach of the keyframes of a drive that it does not know yet, and of how the cameras moved between
/// them: the same motions as estimateCameraMotions() gives of the whole drive.
void tellCoach(const MappingState& state, const RobustOptions& camera_motion, CalibrationCoach* coach);

}  // namespace vcharge
