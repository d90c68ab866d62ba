#include "vcharge_core/camera/pinhole_camera.h"

#include <cmath>
#include <stdexcept>

namespace vcharge {

PinholeCamera::PinholeCamera(const Parameters& parameters)
    : fx_(parameters[0]),
      fy_(parameters[1]),
      cx_(parameters[2]),
      cy_(parameters[3]),
      distortion_(parameters[4], parameters[5], parameters[6], parameters[7]) {
  if (!parameters.allFinite()) {
    throw std::invalid_argument("pinhole: all parameters must be finite");
  }
  if (fx_ <= 0.0 || fy_ <= 0.0) {
    throw std::invalid_argument("fx, fy: must be positive");
  }
}

PinholeCamera::Parameters PinholeCamera::parameters() const {
  return (Parameters() << fx_, fy_, cx_, cy_, distortion_.k1(), distortion_.k2(), distortion_.p1(),
          distortion_.p2())
      .finished();
}

bool PinholeCamera::project(const Eigen::Vector3d& point_in_camera, Eigen::Vector2d* pixel,
                            Eigen::Matrix<double, 2, 3>* pixel_by_point,
                            Eigen::Matrix<double, 2, kNumParameters>* pixel_by_parameters) const {
  if (!point_in_camera.allFinite() || !(point_in_camera.z() > 1e-9 * point_in_camera.norm())) {
    return false;
  }
  const double inverse_z = 1.0 / point_in_camera.z();
  const Eigen::Vector2d undistorted = point_in_camera.head<2>() * inverse_z;
  const bool by_parameters = pixel_by_parameters != nullptr;
  Eigen::Vector2d distorted;
  Eigen::Matrix2d distorted_by_undistorted;
  Eigen::Matrix<double, 2, 4> distorted_by_coefficients;
  if (!distortion_.distort(undistorted, &distorted,
                           pixel_by_point != nullptr ? &distorted_by_undistorted : nullptr,
                           by_parameters ? &distorted_by_coefficients : nullptr)) {
    return false;
  }
  *pixel = Eigen::Vector2d(fx_ * distorted.x() + cx_, fy_ * distorted.y() + cy_);
  const Eigen::DiagonalMatrix<double, 2> focal(fx_, fy_);
  if (pixel_by_point != nullptr) {
    Eigen::Matrix<double, 2, 3> undistorted_by_point;
    undistorted_by_point << inverse_z, 0.0, -undistorted.x() * inverse_z,  //
        0.0, inverse_z, -undistorted.y() * inverse_z;
    *pixel_by_point = focal * distorted_by_undistorted * undistorted_by_point;
  }
  if (by_parameters) {
    pixel_by_parameters->setZero();
    (*pixel_by_parameters)(0, 0) = distorted.x();
    (*pixel_by_parameters)(1, 1) = distorted.y();
    (*pixel_by_parameters)(0, 2) = 1.0;
    (*pixel_by_parameters)(1, 3) = 1.0;
    pixel_by_parameters->rightCols<4>() = focal * distorted_by_coefficients;
  }
  return true;
}

bool PinholeCamera::unproject(const Eigen::Vector2d& pixel, Eigen::Vector3d* ray_in_camera) const {
  const Eigen::Vector2d distorted((pixel.x() - cx_) / fx_, (pixel.y() - cy_) / fy_);
  Eigen::Vector2d undistorted;
  if (!distortion_.undistort(distorted, &undistorted)) {
    return false;
  }
  *ray_in_camera = Eigen::Vector3d(undistorted.x(), undistorted.y(), 1.0).normalized();
  return true;
}

}  // namespace vcharge
