#pragma once

#include <Eigen/Core>

#include "vcharge_core/motion/cross_matrix.h"
#include "vcharge_core/motion/rigid_transform.h"

namespace vcharge {

/// Derivative of a camera's extrinsics, [dt, dphi], by a move of the body, which carries all cameras, against
/// the vehicle's frame.
inline Eigen::Matrix<double, 6, 6> byMoveOfBody(const RigidTransform& vehicle_from_camera) {
  Eigen::Matrix<double, 6, 6> by_body = Eigen::Matrix<double, 6, 6>::Identity();
  by_body.topRightCorner<3, 3>() = -crossMatrix(vehicle_from_camera.translation());
  return by_body;
}

}  // namespace vcharge
