#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "vcharge_calibration/initialization/hand_eye.h"
#include "vcharge_reconstruction/reconstruction_data.h"
#include "vcharge_reconstruction/triangulation.h"

namespace vcharge {

/// Up in a camera's frame, a unit vector, by the ground: the plane along the direction of travel that
/// contains most points. Needs no turn and no extrinsics, but a camera that is mounted upright, since a wall
/// beside the path is a plane too. `motions` are those of the camera from keyframe to keyframe, with the
/// odometer's distances. Empty where too few points lie in such a plane.
std::optional<Eigen::Vector3d> findUpwards(const ReconstructionData& data, int32_t camera,
                                           const std::vector<MotionPair>& motions,
                                           const TriangulationOptions& options);

}  // namespace vcharge
