#pragma once

#include <array>

#include <Eigen/Core>

#include "vcharge_core/camera/radial_tangential_distortion.h"

namespace vcharge {

/// Perspective projection with radial-tangential distortion, for points in front of the camera only.
class PinholeCamera {
 public:
  static constexpr int kNumParameters = 8;
  static constexpr int kFocalLengths = 0;  ///< index of two focal lengths, followed by the principal point
  static constexpr const char* kName = "pinhole";
  using Parameters = Eigen::Matrix<double, kNumParameters, 1>;
  static constexpr std::array<const char*, kNumParameters> parameterNames() {
    return {"fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2"};
  }

  /// Throws std::invalid_argument unless focal lengths are positive and all parameters are finite.
  explicit PinholeCamera(const Parameters& parameters);

  Parameters parameters() const;
  const RadialTangentialDistortion& distortion() const { return distortion_; }

  /// See MeiCamera::project.
  bool project(const Eigen::Vector3d& point_in_camera, Eigen::Vector2d* pixel,
               Eigen::Matrix<double, 2, 3>* pixel_by_point = nullptr,
               Eigen::Matrix<double, 2, kNumParameters>* pixel_by_parameters = nullptr) const;
  /// See MeiCamera::unproject.
  bool unproject(const Eigen::Vector2d& pixel, Eigen::Vector3d* ray_in_camera) const;

 private:
  double fx_, fy_, cx_, cy_;
  RadialTangentialDistortion distortion_;
};

}  // namespace vcharge
