#include "vcharge_core/camera/mei_camera.h"

#include <cmath>
#include <stdexcept>

namespace vcharge {

MeiCamera::MeiCamera(const Parameters& parameters)
    : xi_(parameters[0]),
      gamma1_(parameters[1]),
      gamma2_(parameters[2]),
      u0_(parameters[3]),
      v0_(parameters[4]),
      distortion_(parameters[5], parameters[6], parameters[7], parameters[8]),
      min_cos_angle_(parameters[0] > 1.0 ? -1.0 / parameters[0] : -parameters[0]) {
  if (!parameters.allFinite()) {
    throw std::invalid_argument("mei: all parameters must be finite");
  }
  if (xi_ < 0.0) {
    throw std::invalid_argument("xi: must be at least 0");
  }
  if (gamma1_ <= 0.0 || gamma2_ <= 0.0) {
    throw std::invalid_argument("gamma1, gamma2: must be positive");
  }
}

MeiCamera::MeiCamera(double xi, double gamma1, double gamma2, double u0, double v0)
    : MeiCamera((Parameters() << xi, gamma1, gamma2, u0, v0, 0.0, 0.0, 0.0, 0.0).finished()) {}

MeiCamera::Parameters MeiCamera::parameters() const {
  return (Parameters() << xi_, gamma1_, gamma2_, u0_, v0_, distortion_.k1(), distortion_.k2(),
          distortion_.p1(), distortion_.p2())
      .finished();
}

bool MeiCamera::project(const Eigen::Vector3d& point_in_camera, Eigen::Vector2d* pixel,
                        Eigen::Matrix<double, 2, 3>* pixel_by_point,
                        Eigen::Matrix<double, 2, kNumParameters>* pixel_by_parameters) const {
  const double norm = point_in_camera.norm();
  if (!(norm > 0.0) || !std::isfinite(norm)) {
    return false;
  }
  const Eigen::Vector3d direction = point_in_camera / norm;
  if (!(direction.z() > min_cos_angle_)) {
    return false;
  }
  const double inverse_z = 1.0 / (direction.z() + xi_);
  const Eigen::Vector2d undistorted = direction.head<2>() * inverse_z;

  const bool derivatives = pixel_by_point != nullptr || pixel_by_parameters != nullptr;
  Eigen::Vector2d distorted;
  Eigen::Matrix2d distorted_by_undistorted;
  Eigen::Matrix<double, 2, 4> distorted_by_coefficients;
  if (!distortion_.distort(undistorted, &distorted, derivatives ? &distorted_by_undistorted : nullptr,
                           pixel_by_parameters != nullptr ? &distorted_by_coefficients : nullptr)) {
    return false;
  }
  *pixel = Eigen::Vector2d(gamma1_ * distorted.x() + u0_, gamma2_ * distorted.y() + v0_);
  if (!derivatives) {
    return true;
  }
  const Eigen::DiagonalMatrix<double, 2> gamma(gamma1_, gamma2_);
  const Eigen::Matrix2d pixel_by_undistorted = gamma * distorted_by_undistorted;
  if (pixel_by_point != nullptr) {
    Eigen::Matrix<double, 2, 3> undistorted_by_direction;
    undistorted_by_direction << inverse_z, 0.0, -undistorted.x() * inverse_z,  //
        0.0, inverse_z, -undistorted.y() * inverse_z;
    const Eigen::Matrix3d direction_by_point =
        (Eigen::Matrix3d::Identity() - direction * direction.transpose()) / norm;
    *pixel_by_point = pixel_by_undistorted * undistorted_by_direction * direction_by_point;
  }
  if (pixel_by_parameters != nullptr) {
    pixel_by_parameters->setZero();
    pixel_by_parameters->col(0) = pixel_by_undistorted * (-inverse_z * undistorted);
    (*pixel_by_parameters)(0, 1) = distorted.x();
    (*pixel_by_parameters)(1, 2) = distorted.y();
    (*pixel_by_parameters)(0, 3) = 1.0;
    (*pixel_by_parameters)(1, 4) = 1.0;
    pixel_by_parameters->rightCols<4>() = gamma * distorted_by_coefficients;
  }
  return true;
}

bool MeiCamera::unproject(const Eigen::Vector2d& pixel, Eigen::Vector3d* ray_in_camera) const {
  const Eigen::Vector2d distorted((pixel.x() - u0_) / gamma1_, (pixel.y() - v0_) / gamma2_);
  Eigen::Vector2d undistorted;
  if (!distortion_.undistort(distorted, &undistorted)) {
    return false;
  }
  const double squared_radius = undistorted.squaredNorm();
  const double discriminant = 1.0 + (1.0 - xi_ * xi_) * squared_radius;
  if (!(discriminant > 0.0)) {
    return false;
  }
  const double scale = (xi_ + std::sqrt(discriminant)) / (squared_radius + 1.0);
  *ray_in_camera = Eigen::Vector3d(scale * undistorted.x(), scale * undistorted.y(), scale - xi_);
  return true;
}

}  // namespace vcharge
