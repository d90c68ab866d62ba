#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "vcharge_core/base/timestamp.h"
#include "vcharge_core/files/content_hash.h"
#include "vcharge_core/motion/rigid_transform.h"

namespace vcharge {

enum class ObjectClass : uint8_t { kUnknown, kAdult, kChild, kCar, kBicycle };

/// "unknown", "adult", "child", "car" or "bicycle" (with its rider).
std::string nameOf(ObjectClass object_class);
/// Inverse of nameOf; absent for any other text.
std::optional<ObjectClass> objectClassOf(const std::string& name);

/// An object that can move, at one time, in a frame with z up: the world for true objects, odom for tracked
/// ones. Metres.
struct TrackedObject {
  uint32_t id = 0;  ///< the same as long as the object is followed
  ObjectClass object_class = ObjectClass::kUnknown;
  double class_probability = 1.0;
  double existence_probability = 1.0;
  RigidTransform frame_from_object;  ///< origin on the ground in the middle of the object, x forwards
  Eigen::Vector3d velocity_m_per_s = Eigen::Vector3d::Zero();  ///< of the origin, along the frame's axes
  bool is_standing = false;
  /// Covariance of [position, velocity] along the frame's axes.
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
  std::vector<Eigen::Vector2d> footprint_m;  ///< convex, counter-clockwise
  double base_z_m = 0.0;                     ///< height of the footprint
  double height_m = 0.0;
};

/// The tracked objects at one stamp, in the frame odom.
struct ObjectFrame {
  Timestamp stamp;
  RigidTransform odom_from_vehicle;
  std::vector<TrackedObject> objects;
};

void addToHash(const ObjectFrame& frame, ContentHasher* hasher);

}  // namespace vcharge
