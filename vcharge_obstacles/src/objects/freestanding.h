#pragma once

#include <vector>

#include <Eigen/Core>

#include "contacts/ground_contact.h"
#include "objects/object_detections.h"
#include "vcharge_core/motion/rigid_transform.h"

namespace vcharge {

/// Where one camera is, and what it moves.
struct CameraMotion {
  Eigen::Vector3d position_m;        ///< in the vehicle frame
  double axis_azimuth_rad = 0.0;     ///< of its optical axis
  Eigen::Vector2d velocity_m_per_s;  ///< over the ground, along the vehicle's axes
};

/// The motion of a camera, from that of its vehicle since `duration_s` ago; at rest without a duration.
CameraMotion motionOf(const RigidTransform& vehicle_from_camera, const RigidTransform& now_from_before,
                      double duration_s);

/// Narrow things that stand apart on the ground, as people do, by the contacts in one camera's view: the
/// ground beside them is visible further away. They have no velocity; whether they walk is seen as their
/// contacts are followed.
std::vector<ObjectDetection> findFreestanding(const GroundContact& contact, const CameraMotion& camera);

}  // namespace vcharge
