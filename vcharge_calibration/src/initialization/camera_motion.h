#pragma once

#include <vector>

#include "vcharge_calibration/initialization/hand_eye.h"
#include "vcharge_reconstruction/reconstruction_state.h"

namespace vcharge {

/// Monocular visual odometry: estimates a camera's motions between consecutive keyframes from its tracks
/// and pairs them with the odometer's. Leaves out motions that cannot be estimated. Data parallel.
std::vector<MotionPair> estimateCameraMotions(const ReconstructionData& data, int32_t camera);

}  // namespace vcharge
