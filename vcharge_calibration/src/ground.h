#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "vcharge_mapping/mapping_data.h"

namespace vcharge {

/// Where the ground is below a camera that was put at height zero, from its landmarks alone: the level on which
/// most of the points near the path lie. Gives the camera's height. Empty where the camera sees too little
/// ground.
std::optional<double> findCameraHeight(const MappingData& data, int32_t camera);

/// The ground as all cameras together see it around the vehicle: z = height + slope_x x + slope_y y in the
/// vehicle's frame.
struct GroundPlane {
  Eigen::Vector3d height_and_slopes = Eigen::Vector3d::Zero();             ///< metres; 1; 1
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< of these, from how parts of the drive differ
  int num_keyframes = 0;  ///< at which enough ground was seen
  int num_points = 0;     ///< on average
};

/// Mean over the keyframes, robust within each. Empty where at too few of them enough ground is seen. The
/// vehicle's frame must be within `max_distance_m` of the ground already.
std::optional<GroundPlane> fitGround(const MappingData& data, double max_distance_m);

/// The motion of the vehicle's frame, new_from_old, that puts the ground to z = 0.
RigidTransform levelFromVehicle(const GroundPlane& ground);

/// Moves the vehicle's frame: the cameras on it, the keyframes and the map's frame alike, so that nothing that
/// was seen changes.
void moveVehicleFrame(const RigidTransform& new_from_old, MappingData* data);

}  // namespace vcharge
