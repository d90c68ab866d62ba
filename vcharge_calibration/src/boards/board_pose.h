#pragma once

#include <optional>
#include <vector>

#include "vcharge_calibration/boards/calibration_board.h"
#include "vcharge_core/camera/camera_model.h"
#include "vcharge_core/motion/rigid_transform.h"

namespace vcharge {

/// A point on a board's plane (metres) and the unit ray to it in the camera frame.
struct BoardRay {
  Eigen::Vector2d point_m;
  Eigen::Vector3d ray;
};

/// Pose of a board from at least four rays, which may be more than 90 degrees from the axis: the homography
/// from the plane to the rays, converted to a rotation and translation. Empty if the rays do not determine
/// it.
std::optional<RigidTransform> boardPoseFromRays(const std::vector<BoardRay>& rays);

/// Pose of a board from its corners in an image; ignores corners without a ray.
std::optional<RigidTransform> boardPose(const CalibrationBoard& board,
                                        const std::vector<BoardCorner>& corners, const CameraModel& model);

}  // namespace vcharge
