#pragma once

#include <cmath>
#include <vector>

#include "vcharge_calibration/hand_eye.h"
#include "vcharge_geometry/robust_options.h"
#include "vcharge_mapping/mapping_state.h"

namespace vcharge {

/// Monocular visual odometry of one camera: how it moved from keyframe to keyframe, by the points that it
/// followed, beside what the odometer counted. Motions that cannot be told are left out. Data parallel.
std::vector<MotionPair> estimateCameraMotions(const MappingData& data, int32_t camera,
                                              const RobustOptions& options);

/// By how much the odometer's stamps are late against the images, seconds, from when the turns begin and end;
/// and its standard deviation. The motions are those of cameras at first guesses of their verticals.
struct TimeOffset {
  double offset_s = 0.0;
  double sigma_s = INFINITY;
};
/// Cameras' motions, and the vertical in each camera's frame.
TimeOffset estimateTimeOffset(const MappingState& state,
                              const std::vector<std::vector<MotionPair>>& motions_of_camera,
                              const std::vector<Eigen::Vector3d>& up_in_camera);

}  // namespace vcharge
