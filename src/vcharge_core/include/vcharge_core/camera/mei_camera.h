#pragma once

#include <array>

#include <Eigen/Core>

#include "vcharge_core/camera/radial_tangential_distortion.h"

namespace vcharge {

/// Unified projection with radial-tangential distortion (Mei and Rives, ICRA 2007; paper, section Camera
/// Model): the point on the unit sphere is seen from `xi` behind the sphere's centre, distorted in the
/// normalized plane and scaled by gamma. In the distortion `r` is the squared radius.
///
/// A point at angle theta from the axis has an image while cos(theta) > -1/xi (xi > 1) or > -xi (xi <= 1),
/// and while the radial distortion still grows with the radius; beyond that project() returns false.
class MeiCamera {
 public:
  static constexpr int kNumParameters = 9;
  static constexpr const char* kName = "mei";
  using Parameters = Eigen::Matrix<double, kNumParameters, 1>;
  static constexpr std::array<const char*, kNumParameters> parameterNames() {
    return {"xi", "gamma1", "gamma2", "u0", "v0", "k1", "k2", "p1", "p2"};
  }

  /// std::invalid_argument when gamma is not positive, xi is negative, or anything is not finite.
  explicit MeiCamera(const Parameters& parameters);
  /// Without distortion.
  MeiCamera(double xi, double gamma1, double gamma2, double u0, double v0);

  Parameters parameters() const;
  double xi() const { return xi_; }
  double gamma1() const { return gamma1_; }
  double gamma2() const { return gamma2_; }
  double u0() const { return u0_; }
  double v0() const { return v0_; }
  const RadialTangentialDistortion& distortion() const { return distortion_; }

  /// Pixel of a point; false (outputs untouched) where the model has no image of it. Optional Jacobians of
  /// the pixel by the point and by the parameters.
  bool project(const Eigen::Vector3d& point_in_camera, Eigen::Vector2d* pixel,
               Eigen::Matrix<double, 2, 3>* pixel_by_point = nullptr,
               Eigen::Matrix<double, 2, kNumParameters>* pixel_by_parameters = nullptr) const;

  /// Unit ray of a pixel, by Newton's method on the distortion and the closed inverse of the unified
  /// projection, which exists for r_u^2 <= 1 / (xi^2 - 1) when xi > 1. False (output untouched) elsewhere.
  bool unproject(const Eigen::Vector2d& pixel, Eigen::Vector3d* ray_in_camera) const;

 private:
  double xi_, gamma1_, gamma2_, u0_, v0_;
  RadialTangentialDistortion distortion_;
  double min_cos_angle_;
};

}  // namespace vcharge
