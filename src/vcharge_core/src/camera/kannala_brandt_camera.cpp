#include "vcharge_core/camera/kannala_brandt_camera.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace vcharge {
namespace {

constexpr double kPi = 3.14159265358979323846;

double radiusOfAngle(const KannalaBrandtCamera::Parameters& p, double angle) {
  const double s = angle * angle;
  return angle * (1.0 + s * (p[4] + s * (p[5] + s * (p[6] + s * p[7]))));
}

double radiusSlope(const KannalaBrandtCamera::Parameters& p, double angle) {
  const double s = angle * angle;
  return 1.0 + s * (3.0 * p[4] + s * (5.0 * p[5] + s * (7.0 * p[6] + s * 9.0 * p[7])));
}

/// Angle at which the radius stops growing, at most pi.
double angleOfFold(const KannalaBrandtCamera::Parameters& p) {
  constexpr int kSteps = 2000;
  double previous = 0.0;
  for (int i = 1; i <= kSteps; ++i) {
    const double angle = kPi * i / kSteps;
    if (radiusSlope(p, angle) <= 0.0) {
      double low = previous;
      double high = angle;
      for (int j = 0; j < 60; ++j) {
        const double middle = 0.5 * (low + high);
        (radiusSlope(p, middle) > 0.0 ? low : high) = middle;
      }
      return low;
    }
    previous = angle;
  }
  return kPi;
}

}  // namespace

KannalaBrandtCamera::KannalaBrandtCamera(const Parameters& parameters) : parameters_(parameters) {
  if (!parameters.allFinite()) {
    throw std::invalid_argument("kannala_brandt: all parameters must be finite");
  }
  if (parameters[0] <= 0.0 || parameters[1] <= 0.0) {
    throw std::invalid_argument("fx, fy: must be positive");
  }
  max_angle_rad_ = angleOfFold(parameters);
  max_radius_ = radiusOfAngle(parameters, max_angle_rad_);
}

bool KannalaBrandtCamera::project(const Eigen::Vector3d& point_in_camera, Eigen::Vector2d* pixel,
                                  Eigen::Matrix<double, 2, 3>* pixel_by_point,
                                  Eigen::Matrix<double, 2, kNumParameters>* pixel_by_parameters) const {
  const double x = point_in_camera.x();
  const double y = point_in_camera.y();
  const double z = point_in_camera.z();
  const double lateral = std::hypot(x, y);
  const double squared_norm = point_in_camera.squaredNorm();
  if (!(squared_norm > 0.0) || !std::isfinite(squared_norm)) {
    return false;
  }
  const double angle = std::atan2(lateral, z);
  if (!(angle < max_angle_rad_)) {
    return false;
  }
  const double fx = parameters_[0];
  const double fy = parameters_[1];
  const double radius = radiusOfAngle(parameters_, angle);
  // Near the axis, the model equals a pinhole camera to first order.
  const bool on_axis = lateral < 1e-12 * z;
  const double radius_over_lateral = on_axis ? 1.0 / z : radius / lateral;
  const Eigen::Vector2d image(radius_over_lateral * x, radius_over_lateral * y);
  *pixel = Eigen::Vector2d(fx * image.x() + parameters_[2], fy * image.y() + parameters_[3]);

  if (pixel_by_point != nullptr) {
    Eigen::Matrix<double, 2, 3> image_by_point;
    if (on_axis) {
      image_by_point << 1.0 / z, 0.0, -x / (z * z), 0.0, 1.0 / z, -y / (z * z);
    } else {
      const double slope = radiusSlope(parameters_, angle);
      const double cosine = x / lateral;
      const double sine = y / lateral;
      const Eigen::RowVector3d angle_by_point(cosine * z / squared_norm, sine * z / squared_norm,
                                              -lateral / squared_norm);
      image_by_point.row(0) = cosine * slope * angle_by_point;
      image_by_point.row(1) = sine * slope * angle_by_point;
      image_by_point(0, 0) += radius_over_lateral * sine * sine;
      image_by_point(0, 1) -= radius_over_lateral * sine * cosine;
      image_by_point(1, 0) -= radius_over_lateral * sine * cosine;
      image_by_point(1, 1) += radius_over_lateral * cosine * cosine;
    }
    *pixel_by_point = Eigen::DiagonalMatrix<double, 2>(fx, fy) * image_by_point;
  }
  if (pixel_by_parameters != nullptr) {
    pixel_by_parameters->setZero();
    (*pixel_by_parameters)(0, 0) = image.x();
    (*pixel_by_parameters)(1, 1) = image.y();
    (*pixel_by_parameters)(0, 2) = 1.0;
    (*pixel_by_parameters)(1, 3) = 1.0;
    const double cosine = on_axis ? 0.0 : x / lateral;
    const double sine = on_axis ? 0.0 : y / lateral;
    double power = angle;
    for (int i = 0; i < 4; ++i) {
      power *= angle * angle;
      (*pixel_by_parameters)(0, 4 + i) = fx * cosine * power;
      (*pixel_by_parameters)(1, 4 + i) = fy * sine * power;
    }
  }
  return true;
}

bool KannalaBrandtCamera::unproject(const Eigen::Vector2d& pixel, Eigen::Vector3d* ray_in_camera) const {
  const Eigen::Vector2d image((pixel.x() - parameters_[2]) / parameters_[0],
                              (pixel.y() - parameters_[3]) / parameters_[1]);
  const double radius = image.norm();
  if (!(radius < max_radius_)) {
    return false;
  }
  double low = 0.0;
  double high = max_angle_rad_;
  double angle = std::min(radius, 0.5 * (low + high));
  constexpr int kMaxIterations = 60;
  for (int i = 0; i < kMaxIterations; ++i) {
    const double error = radiusOfAngle(parameters_, angle) - radius;
    (error < 0.0 ? low : high) = angle;
    double next = angle - error / radiusSlope(parameters_, angle);
    if (!(next >= low && next <= high)) {
      next = 0.5 * (low + high);
    }
    const double step = std::abs(next - angle);
    angle = next;
    if (step <= 1e-16 * (1.0 + angle)) {
      break;
    }
  }
  const double scale = radius > 0.0 ? std::sin(angle) / radius : 1.0;
  *ray_in_camera = Eigen::Vector3d(scale * image.x(), scale * image.y(), std::cos(angle)).normalized();
  return true;
}

}  // namespace vcharge
