#include "vcharge_core/motion/rigid_transform.h"

#include <cmath>

#include <Eigen/SVD>

#include "vcharge_core/base/error.h"

namespace vcharge {

Eigen::Quaterniond rotationFromVector(const Eigen::Vector3d& rotation_vector) {
  const double angle = rotation_vector.norm();
  // sin(angle / 2) / angle, as a series near zero.
  const double scale = angle < 1e-6 ? 0.5 - angle * angle / 48.0 : std::sin(0.5 * angle) / angle;
  const Eigen::Vector3d imaginary = scale * rotation_vector;
  return Eigen::Quaterniond(std::cos(0.5 * angle), imaginary.x(), imaginary.y(), imaginary.z());
}

Eigen::Vector3d vectorFromRotation(const Eigen::Quaterniond& rotation) {
  const double sign = rotation.w() < 0.0 ? -1.0 : 1.0;
  const Eigen::Vector3d imaginary = sign * rotation.vec();
  const double sine = imaginary.norm();
  const double cosine = sign * rotation.w();
  if (sine < 1e-9) {
    return 2.0 * imaginary;
  }
  return (2.0 * std::atan2(sine, cosine) / sine) * imaginary;
}

double angleOfRotation(const Eigen::Quaterniond& rotation) {
  return 2.0 * std::atan2(rotation.vec().norm(), std::abs(rotation.w()));
}

Eigen::Quaterniond rotationFromYawPitchRoll(double yaw_rad, double pitch_rad, double roll_rad) {
  return Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ()) *
         Eigen::AngleAxisd(pitch_rad, Eigen::Vector3d::UnitY()) *
         Eigen::AngleAxisd(roll_rad, Eigen::Vector3d::UnitX());
}

double yawOfRotation(const Eigen::Quaterniond& rotation) {
  const Eigen::Vector3d forward = rotation * Eigen::Vector3d::UnitX();
  return std::atan2(forward.y(), forward.x());
}

RigidTransform::RigidTransform(const Eigen::Quaterniond& rotation, const Eigen::Vector3d& translation_m)
    : rotation_(rotation), translation_(translation_m) {
  const double norm = rotation_.norm();
  check(std::isfinite(norm) && norm > 0.0, "RigidTransform: rotation must be finite and not zero");
  check(translation_.allFinite(), "RigidTransform: translation must be finite");
  rotation_.coeffs() /= norm;
}

RigidTransform RigidTransform::fromUnit(const Eigen::Quaterniond& rotation,
                                        const Eigen::Vector3d& translation_m) {
  check(std::abs(rotation.norm() - 1.0) <= 1e-12, "RigidTransform: expected a unit quaternion");
  RigidTransform transform(rotation, translation_m);
  transform.rotation_ = rotation;
  return transform;
}

RigidTransform RigidTransform::fromMatrix(const Eigen::Matrix<double, 3, 4>& matrix) {
  check(matrix.allFinite(), "RigidTransform::fromMatrix: matrix must be finite");
  const Eigen::Matrix3d linear = matrix.leftCols<3>();
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(linear, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Vector3d signs(1.0, 1.0,
                        (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0.0 ? -1.0 : 1.0);
  const Eigen::Matrix3d rotation = svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
  return RigidTransform(Eigen::Quaterniond(rotation), matrix.col(3));
}

RigidTransform RigidTransform::planar(double x_m, double y_m, double yaw_rad) {
  return RigidTransform(rotationFromYawPitchRoll(yaw_rad, 0.0, 0.0), Eigen::Vector3d(x_m, y_m, 0.0));
}

Eigen::Matrix<double, 3, 4> RigidTransform::matrix() const {
  Eigen::Matrix<double, 3, 4> matrix;
  matrix << rotationMatrix(), translation_;
  return matrix;
}

RigidTransform RigidTransform::inverse() const {
  const Eigen::Quaterniond inverse_rotation = rotation_.conjugate();
  return RigidTransform(inverse_rotation, -(inverse_rotation * translation_));
}

RigidTransform RigidTransform::operator*(const RigidTransform& other) const {
  return RigidTransform(rotation_ * other.rotation_, rotation_ * other.translation_ + translation_);
}

RigidTransform interpolate(const RigidTransform& from, const RigidTransform& to, double fraction) {
  return RigidTransform(from.rotation().slerp(fraction, to.rotation()),
                        (1.0 - fraction) * from.translation() + fraction * to.translation());
}

}  // namespace vcharge
