#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "vcharge_core/motion/rigid_transform.h"
#include "vcharge_dense/plane_sweep_options.h"

namespace vcharge {

/// Plane of the points X with normal . X + distance_m = 0; the unit normal points towards the origin's side.
struct Plane {
  Eigen::Vector3d normal;
  double distance_m;
};

/// The ground under the vehicle (z = 0 of the vehicle frame) in a camera's frame. Throws
/// std::invalid_argument if the camera is not above it.
Plane groundInCamera(const RigidTransform& vehicle_from_camera);

/// Parallel planes, ordered from far to near. Along the unit ray r plane i has the inverse range
/// inverse_distances_per_m[i] * (-normal . r), the inverse of the paper's depth -d / (n . r).
struct PlaneFamily {
  Eigen::Vector3d normal;  ///< in the camera frame, pointing to the camera
  std::vector<float> inverse_distances_per_m;
  bool is_uniform = true;  ///< inverse distances are equally spaced
};

/// Unit vectors in the camera frame, each perpendicular to the planes of one family and pointing away from
/// the camera. Fronto-parallel planes have the optical axis.
using PlaneAxes = std::vector<Eigen::Vector3d>;
inline PlaneAxes opticalAxis() {
  return {Eigen::Vector3d::UnitZ()};
}

/// Makes the families of planes that the options select: one per axis, in their order, then the planes
/// parallel to the ground. Throws std::invalid_argument if they need a ground that is not given, or if the
/// camera is not more than 0.3 m above it.
std::vector<PlaneFamily> makePlaneFamilies(const PlaneSweepOptions& options,
                                           const std::optional<Plane>& ground_in_camera,
                                           const PlaneAxes& axes = opticalAxis());

}  // namespace vcharge
