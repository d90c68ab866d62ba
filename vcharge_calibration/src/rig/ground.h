#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "vcharge_reconstruction/mapping_data.h"

namespace vcharge {

/// Where the ground is below a camera that was put at height zero, from its landmarks alone: the level on
/// which most of the points near the path lie. Gives the camera's height. Empty where the camera sees too
/// little ground.
std::optional<double> findCameraHeight(const MappingData& data, int32_t camera);

/// A landmark on the ground, and the keyframe that passed nearest to it.
struct GroundPoint {
  int32_t track = 0;
  int32_t keyframe = 0;
};

/// Landmarks that lie within `max_distance_m` of the vehicle's z = 0 and near its path: the ground, to the
/// accuracy of poses and rig. In order of tracks.
std::vector<GroundPoint> findGroundPoints(const MappingData& data, double max_distance_m);

}  // namespace vcharge
