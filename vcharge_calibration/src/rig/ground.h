#pragma once

#include <memory>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "vcharge_reconstruction/reconstruction_data.h"

namespace vcharge {

/// Height of a camera above the ground from its landmarks alone: the most frequent level of points near the
/// path. The rig of `data` has the camera at height zero. Empty if the camera sees too little ground.
std::optional<double> findCameraHeight(const ReconstructionData& data, int32_t camera);

/// Returns the rig of `data` with each camera at its height; a camera without one gets the median height.
/// Throws NotCalibrated if no camera sees the ground.
std::shared_ptr<const CameraRig> withCameraHeights(const ReconstructionData& data);

/// A landmark on the ground, and the nearest keyframe that observes it.
struct GroundPoint {
  int32_t track = 0;
  int32_t keyframe = 0;
  double height_sigma_m = 0.0;  ///< infinite where the landmark has not been adjusted
};

/// Landmarks within `max_distance_m` of the vehicle's z = 0 and near its path, in order of tracks.
std::vector<GroundPoint> findGroundPoints(const ReconstructionData& data, double max_distance_m);
/// Those of them whose height is precise.
std::vector<GroundPoint> findPreciseGround(const ReconstructionData& data, double max_distance_m);

/// What the ground tells wrongly, as standard deviations: the height of the cameras (m), and their roll and
/// pitch (rad), as one rigid body. Zero where its landmarks have not been adjusted.
struct GroundBias {
  double height_m = 0.0, roll_rad = 0.0, pitch_rad = 0.0;
};
GroundBias findGroundBias(const ReconstructionData& data, const std::vector<GroundPoint>& points);

}  // namespace vcharge
