#pragma once

#include <array>

#include <Eigen/Core>

#include "vcharge_core/camera/radial_tangential_distortion.h"

namespace vcharge {

/// Unified projection with radial-tangential distortion (Mei and Rives, ICRA 2007; paper, section Camera
/// Model): a point on the unit sphere is projected from a centre `xi` behind the sphere's centre, distorted
/// in the normalized plane and scaled by gamma. In the distortion, `r` is the squared radius.
/// A point at angle theta from the axis has an image while cos(theta) > -1/xi (xi > 1) or > -xi (xi <= 1),
/// and while the radial distortion grows with the radius; project() returns false beyond that.
class MeiCamera {
 public:
  static constexpr int kNumParameters = 9;
  static constexpr int kFocalLengths = 1;  ///< index of two focal lengths, followed by the principal point
  static constexpr const char* kName = "mei";
  using Parameters = Eigen::Matrix<double, kNumParameters, 1>;
  static constexpr std::array<const char*, kNumParameters> parameterNames() {
    return {"xi", "gamma1", "gamma2", "u0", "v0", "k1", "k2", "p1", "p2"};
  }

  /// Throws std::invalid_argument unless gamma is positive, xi is not negative and all parameters are finite.
  explicit MeiCamera(const Parameters& parameters);
  /// A camera without distortion.
  MeiCamera(double xi, double gamma1, double gamma2, double u0, double v0);

  Parameters parameters() const;
  double xi() const { return xi_; }
  double gamma1() const { return gamma1_; }
  double gamma2() const { return gamma2_; }
  double u0() const { return u0_; }
  double v0() const { return v0_; }
  const RadialTangentialDistortion& distortion() const { return distortion_; }

  /// Pixel of a point; returns false and leaves the outputs unchanged where the model has no image of it.
  /// Optional Jacobians of the pixel with respect to the point and the parameters.
  bool project(const Eigen::Vector3d& point_in_camera, Eigen::Vector2d* pixel,
               Eigen::Matrix<double, 2, 3>* pixel_by_point = nullptr,
               Eigen::Matrix<double, 2, kNumParameters>* pixel_by_parameters = nullptr) const;

  /// Unit ray of a pixel, by Newton's method on the distortion and the closed-form inverse of the unified
  /// projection, which exists for r_u^2 <= 1 / (xi^2 - 1) if xi > 1. Returns false and leaves the output
  /// unchanged elsewhere.
  bool unproject(const Eigen::Vector2d& pixel, Eigen::Vector3d* ray_in_camera) const;

 private:
  double xi_, gamma1_, gamma2_, u0_, v0_;
  RadialTangentialDistortion distortion_;
  double min_cos_angle_;
};

}  // namespace vcharge
