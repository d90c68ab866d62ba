#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "vcharge_core/motion/rigid_transform.h"

namespace vcharge {

/// A transform for solvers and inner loops: a rotation matrix, which is not checked, and a translation in
/// metres.
struct RotationTranslation {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d translation_m = Eigen::Vector3d::Zero();

  RotationTranslation() = default;
  explicit RotationTranslation(const RigidTransform& transform)
      : rotation(transform.rotationMatrix()), translation_m(transform.translation()) {}
  RigidTransform transform() const { return RigidTransform(Eigen::Quaterniond(rotation), translation_m); }
};

}  // namespace vcharge
