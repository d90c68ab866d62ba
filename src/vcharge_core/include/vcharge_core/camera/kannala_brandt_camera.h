#pragma once

#include <array>

#include <Eigen/Core>

namespace vcharge {

/// Equidistant fisheye model with an odd polynomial in the angle (Kannala and Brandt, PAMI 2006; OpenCV's
/// fisheye, Kalibr's pinhole-equi): r(theta) = theta (1 + k1 theta^2 + k2 theta^4 + k3 theta^6 + k4 theta^8).
/// Valid up to the angle at which r stops growing, at most pi.
class KannalaBrandtCamera {
 public:
  static constexpr int kNumParameters = 8;
  static constexpr int kFocalLengths = 0;  ///< index of two focal lengths, followed by the principal point
  static constexpr const char* kName = "kannala_brandt";
  using Parameters = Eigen::Matrix<double, kNumParameters, 1>;
  static constexpr std::array<const char*, kNumParameters> parameterNames() {
    return {"fx", "fy", "cx", "cy", "k1", "k2", "k3", "k4"};
  }

  /// Throws std::invalid_argument unless focal lengths are positive and all parameters are finite.
  explicit KannalaBrandtCamera(const Parameters& parameters);

  const Parameters& parameters() const { return parameters_; }
  double maxAngle() const { return max_angle_rad_; }

  /// See MeiCamera::project.
  bool project(const Eigen::Vector3d& point_in_camera, Eigen::Vector2d* pixel,
               Eigen::Matrix<double, 2, 3>* pixel_by_point = nullptr,
               Eigen::Matrix<double, 2, kNumParameters>* pixel_by_parameters = nullptr) const;
  /// See MeiCamera::unproject. Newton's method, safeguarded by bisection.
  bool unproject(const Eigen::Vector2d& pixel, Eigen::Vector3d* ray_in_camera) const;

 private:
  Parameters parameters_;
  double max_angle_rad_;
  double max_radius_;
};

}  // namespace vcharge
