#pragma once

#include <vector>

#include "vcharge_calibration/initialization/hand_eye.h"
#include "vcharge_geometry/robust/robust_options.h"
#include "vcharge_reconstruction/mapping_state.h"

namespace vcharge {

/// Monocular visual odometry of one camera: how it moved from keyframe to keyframe, by the points that it
/// followed, beside what the odometer counted. Motions that cannot be told are left out. Data parallel.
std::vector<MotionPair> estimateCameraMotions(const MappingData& data, int32_t camera,
                                              const RobustOptions& options);

}  // namespace vcharge
