#pragma once

#include <cstddef>
#include <vector>

#include "vcharge_calibration/from_map/map_rig_calibrator.h"
#include "vcharge_calibration/initialization/hand_eye.h"
#include "vcharge_reconstruction/reconstruction_data.h"

namespace vcharge {

// Initial extrinsics and poses from the poses of each camera, localized alone.

/// Throws NotCalibrated if a camera was localized at too few keyframes.
void requireEnoughFixes(const std::vector<MapKeyframeView>& views, const CameraRig& rig);

/// Motions of a camera between consecutive keyframes that both have its pose.
std::vector<MotionPair> motionsInMap(const std::vector<MapKeyframeView>& views,
                                     const std::vector<Keyframe>& keyframes, size_t camera);

/// Height of a camera above the ground at the nearest keyframes of the map: the median over all its poses.
double heightInMap(const std::vector<MapKeyframeView>& views, const SparseMap& map, size_t camera);

/// Sets the pose of each keyframe from the camera pose with most inliers; from the odometer if there is
/// none.
void setPosesByFixes(const std::vector<MapKeyframeView>& views, ReconstructionData* data);

}  // namespace vcharge
