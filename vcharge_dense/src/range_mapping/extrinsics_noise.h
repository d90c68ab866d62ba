#pragma once

#include "vcharge_core/camera/rig_condition.h"
#include "vcharge_core/motion/rigid_transform.h"
#include "vcharge_dense/plane_sweep_options.h"

namespace vcharge {

/// Adds what uncertain extrinsics do to the motion of a camera between two images. With extrinsics E, a
/// motion M of the vehicle moves the camera by C = E^-1 M E. To first order, an error of E's rotation turns
/// C's translation, and both errors of E appear in C as far as M turns.
inline void addNoiseOfExtrinsics(const CameraCondition& camera, const RigidTransform& camera_motion,
                                 NeighbourNoise* noise) {
  const double turn_rad = vectorFromRotation(camera_motion.rotation()).norm();
  const double rotation_rad = turn_rad * camera.rotation_sigma_rad;
  const double swing_m = camera_motion.translation().norm() * camera.rotation_sigma_rad;
  const double shift_m = turn_rad * camera.position_sigma_m;
  noise->more_rotation_rad2 += rotation_rad * rotation_rad;
  noise->more_translation_m2 += swing_m * swing_m + shift_m * shift_m;
}

}  // namespace vcharge
