#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "vcharge_core/motion/rigid_transform.h"

namespace vcharge {

/// Viewing ray of a camera in the rig frame: all points origin + depth * direction, depth > 0.
struct Ray {
  Eigen::Vector3d origin_m;   ///< centre of the camera
  Eigen::Vector3d direction;  ///< unit vector
};

/// A line with direction q (unit vector) and moment q' = point x q (metres), which is the same for all of its
/// points. Pless, "Using many cameras as one", CVPR 2003.
struct PlueckerLine {
  Eigen::Vector3d direction;
  Eigen::Vector3d moment_m;
};

inline PlueckerLine lineOfRay(const Ray& ray) {
  return {ray.direction, ray.origin_m.cross(ray.direction)};
}

inline Ray operator*(const RigidTransform& target_from_source, const Ray& ray) {
  return {target_from_source * ray.origin_m, target_from_source.rotation() * ray.direction};
}

inline PlueckerLine operator*(const RigidTransform& target_from_source, const PlueckerLine& line) {
  const Eigen::Vector3d direction = target_from_source.rotation() * line.direction;
  return {direction,
          target_from_source.rotation() * line.moment_m + target_from_source.translation().cross(direction)};
}

/// Lines of sight to a scene point at two instants, each in the rig frame of its instant.
struct LineMatch {
  PlueckerLine previous;
  PlueckerLine current;
};

/// Generalized epipolar constraint (Pless 2003): q^T R m' + q^T [t]x R q' + m^T R q', where (q, m) is the
/// previous line, (q', m') the current one and (R, t) = previous_from_current. Zero if the lines meet;
/// otherwise their distance (metres) times the sine of the angle between them.
inline double generalizedEpipolarConstraint(const LineMatch& match,
                                            const RigidTransform& previous_from_current) {
  const PlueckerLine current_in_previous = previous_from_current * match.current;
  return match.previous.direction.dot(current_in_previous.moment_m) +
         match.previous.moment_m.dot(current_in_previous.direction);
}

}  // namespace vcharge
