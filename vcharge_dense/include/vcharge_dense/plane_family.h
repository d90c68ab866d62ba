#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "vcharge_core/motion/rigid_transform.h"
#include "vcharge_dense/plane_sweep_options.h"

namespace vcharge {

/// The points X with normal . X + distance_m = 0; the unit normal points to the side of the origin.
struct Plane {
  Eigen::Vector3d normal;
  double distance_m;
};

/// The ground under the vehicle (z = 0 of the vehicle frame) in a camera's frame. std::invalid_argument when
/// the camera is not above it.
Plane groundInCamera(const RigidTransform& vehicle_from_camera);

/// Planes with one normal, ordered from far to near. Along the unit ray r the plane i has the inverse range
/// inverse_distances_per_m[i] * (-normal . r), which is the inverse of the paper's depth -d / (n . r).
struct PlaneFamily {
  Eigen::Vector3d normal;  ///< in the camera frame, pointing to the camera
  std::vector<float> inverse_distances_per_m;
  bool is_uniform = true;  ///< inverse distances are equally far apart
};

/// The families that the options name. std::invalid_argument when they need a ground that is not given, or
/// when ground_max_height_m is not below the camera.
std::vector<PlaneFamily> makePlaneFamilies(const PlaneSweepOptions& options,
                                           const std::optional<Plane>& ground_in_camera);

}  // namespace vcharge
