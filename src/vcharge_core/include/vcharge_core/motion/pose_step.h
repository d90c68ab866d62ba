#pragma once

#include <Eigen/Core>

#include "vcharge_core/motion/rigid_transform.h"

namespace vcharge {

// Small motions of a pose target_from_source as steps [dt, dphi], in which also its covariance is given: dt
// (metres) is added to the translation, and dphi (radians) turns it about its origin, both along the target's
// axes.

/// The step from one pose to another.
inline Eigen::Matrix<double, 6, 1> stepBetween(const RigidTransform& from, const RigidTransform& to) {
  Eigen::Matrix<double, 6, 1> step;
  step << to.translation() - from.translation(),
      vectorFromRotation(to.rotation() * from.rotation().conjugate());
  return step;
}

/// The pose after a step.
inline RigidTransform moved(const RigidTransform& pose, const Eigen::Matrix<double, 6, 1>& step) {
  return RigidTransform(rotationFromVector(step.tail<3>()) * pose.rotation(),
                        pose.translation() + step.head<3>());
}

}  // namespace vcharge
