#pragma once

#include <cstddef>
#include <vector>

#include "vcharge_calibration/from_map/map_rig_calibrator.h"
#include "vcharge_calibration/initialization/hand_eye.h"
#include "vcharge_reconstruction/reconstruction_data.h"

namespace vcharge {

// First guesses from the poses at which each camera was localized by itself.

/// NotCalibrated where a camera was localized at too few keyframes.
void requireEnoughFixes(const std::vector<MapKeyframeView>& views, const CameraRig& rig);

/// Motions of a camera between consecutive keyframes with a fix at both.
std::vector<MotionPair> motionsInMap(const std::vector<MapKeyframeView>& views,
                                     const std::vector<Keyframe>& keyframes, size_t camera);

/// Height of a camera above the ground under the nearest keyframes of the map; the median over all fixes.
double heightInMap(const std::vector<MapKeyframeView>& views, const SparseMap& map, size_t camera);

/// Sets the poses of the keyframes from the fix with most inliers at each; by the odometer where there is
/// none.
void setPosesByFixes(const std::vector<MapKeyframeView>& views, ReconstructionData* data);

}  // namespace vcharge
