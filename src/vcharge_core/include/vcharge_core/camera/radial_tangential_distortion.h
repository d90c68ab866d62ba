#pragma once

#include <limits>

#include <Eigen/Core>

namespace vcharge {

/// Radial (k1, k2) and tangential (p1, p2) distortion of a point in the normalized image plane (paper,
/// section Camera Model). One-to-one only within maxRadius(), where the radial part grows with the radius.
class RadialTangentialDistortion {
 public:
  RadialTangentialDistortion() = default;
  /// Throws std::invalid_argument unless all parameters are finite.
  RadialTangentialDistortion(double k1, double k2, double p1, double p2);

  double k1() const { return k1_; }
  double k2() const { return k2_; }
  double p1() const { return p1_; }
  double p2() const { return p2_; }
  bool isZero() const { return k1_ == 0.0 && k2_ == 0.0 && p1_ == 0.0 && p2_ == 0.0; }

  /// Undistorted radius at which the radial part stops growing; infinity if it always grows.
  double maxRadius() const { return max_radius_; }

  /// Distorted point, with optional derivatives with respect to the point and (k1, k2, p1, p2). False beyond
  /// maxRadius().
  bool distort(const Eigen::Vector2d& undistorted, Eigen::Vector2d* distorted,
               Eigen::Matrix2d* by_point = nullptr,
               Eigen::Matrix<double, 2, 4>* by_parameters = nullptr) const;

  /// Inverse of distort() by Newton's method; false if none exists within maxRadius().
  bool undistort(const Eigen::Vector2d& distorted, Eigen::Vector2d* undistorted) const;

 private:
  double k1_ = 0.0, k2_ = 0.0, p1_ = 0.0, p2_ = 0.0;
  double max_radius_ = std::numeric_limits<double>::infinity();
};

}  // namespace vcharge
