#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace vcharge {

/// Rotation by the angle |rotation_vector| (radians) about its direction.
Eigen::Quaterniond rotationFromVector(const Eigen::Vector3d& rotation_vector);
/// Inverse of rotationFromVector; the angle lies in [0, pi].
Eigen::Vector3d vectorFromRotation(const Eigen::Quaterniond& rotation);
/// Angle of the rotation in radians, in [0, pi].
double angleOfRotation(const Eigen::Quaterniond& rotation);
/// Rz(yaw) Ry(pitch) Rx(roll), radians.
Eigen::Quaterniond rotationFromYawPitchRoll(double yaw_rad, double pitch_rad, double roll_rad);
/// Yaw of Rz(yaw) Ry(pitch) Rx(roll), in (-pi, pi].
double yawOfRotation(const Eigen::Quaterniond& rotation);

/// A rotation followed by a translation (metres), named target_from_source:
/// point_in_target = target_from_source * point_in_source. The rotation is always a unit quaternion.
class RigidTransform {
 public:
  RigidTransform() : rotation_(Eigen::Quaterniond::Identity()), translation_(Eigen::Vector3d::Zero()) {}
  /// Normalizes the rotation. Throws std::logic_error when it is zero or anything is not finite.
  RigidTransform(const Eigen::Quaterniond& rotation, const Eigen::Vector3d& translation_m);
  /// Keeps a unit quaternion exactly, to the last bit, so that files can be read back unchanged. Throws
  /// std::logic_error unless its norm is 1 within 1e-12 and everything is finite.
  static RigidTransform fromUnit(const Eigen::Quaterniond& rotation, const Eigen::Vector3d& translation_m);
  /// From a 3x4 matrix [R|t]; R is replaced by the nearest rotation. Throws std::logic_error when not finite.
  static RigidTransform fromMatrix(const Eigen::Matrix<double, 3, 4>& matrix);
  /// Planar motion: x, y in metres, yaw in radians about z.
  static RigidTransform planar(double x_m, double y_m, double yaw_rad);

  const Eigen::Quaterniond& rotation() const { return rotation_; }
  const Eigen::Vector3d& translation() const { return translation_; }
  Eigen::Matrix3d rotationMatrix() const { return rotation_.toRotationMatrix(); }
  Eigen::Matrix<double, 3, 4> matrix() const;

  RigidTransform inverse() const;
  RigidTransform operator*(const RigidTransform& other) const;
  Eigen::Vector3d operator*(const Eigen::Vector3d& point_in_source) const {
    return rotation_ * point_in_source + translation_;
  }

 private:
  Eigen::Quaterniond rotation_;
  Eigen::Vector3d translation_;
};

/// Interpolates translation linearly and rotation spherically; fraction 0 gives `from`, 1 gives `to`.
RigidTransform interpolate(const RigidTransform& from, const RigidTransform& to, double fraction);

}  // namespace vcharge
