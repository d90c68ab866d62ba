#pragma once

#include <array>
#include <memory>

#include "vcharge_core/motion/rigid_transform.h"

namespace ceres {
class Manifold;
}

namespace vcharge {

/// A RigidTransform as a parameter block of Ceres: translation (m), then the quaternion's x, y, z, w.
using PoseBlock = std::array<double, 7>;

PoseBlock toPoseBlock(const RigidTransform& target_from_source);
RigidTransform fromPoseBlock(const double* block);
inline RigidTransform fromPoseBlock(const PoseBlock& block) {
  return fromPoseBlock(block.data());
}

/// Manifold of a PoseBlock with tangent [dt, dphi] in the target frame: t = t_hat + dt, R = Exp(dphi) R_hat.
/// Covariances of ceres::Covariance in the tangent space therefore have the convention of rig.yaml and
/// messages.
std::unique_ptr<ceres::Manifold> makePoseManifold();

}  // namespace vcharge
