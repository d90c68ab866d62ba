#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "vcharge_calibration/initialization/hand_eye.h"
#include "vcharge_reconstruction/landmarks/triangulation.h"
#include "vcharge_reconstruction/reconstruction_data.h"

namespace vcharge {

/// Estimates the upward direction in a camera's frame (unit vector) from the ground: the plane along the path
/// that contains most points. Needs no turn and no extrinsics, but an upright camera, since a wall
/// beside the path is a plane too. `motions` are the camera's motions between keyframes, with the
/// odometer's distances. Empty if too few points lie in such a plane.
std::optional<Eigen::Vector3d> findUpwards(const ReconstructionData& data, int32_t camera,
                                           const std::vector<MotionPair>& motions,
                                           const TriangulationOptions& options);

}  // namespace vcharge
