#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "vcharge_calibration/initialization/hand_eye.h"
#include "vcharge_reconstruction/mapping_data.h"
#include "vcharge_reconstruction/triangulation.h"

namespace vcharge {

/// Upwards in a camera's frame, a unit vector, by the ground that it sees: the plane along the direction of
/// travel in which most of its points lie. Needs no turn, and neither the camera's place nor its attitude but
/// that it is mounted upright: a wall beside the way is else as good a plane. Lengths are the odometer's.
/// `motions` are those of the camera from keyframe to keyframe. Empty where too few points lie in such a
/// plane.
std::optional<Eigen::Vector3d> findUpwards(const MappingData& data, int32_t camera,
                                           const std::vector<MotionPair>& motions,
                                           const TriangulationOptions& options);

}  // namespace vcharge
