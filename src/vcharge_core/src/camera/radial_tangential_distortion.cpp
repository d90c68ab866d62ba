#include "vcharge_core/camera/radial_tangential_distortion.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include <Eigen/LU>

namespace vcharge {
namespace {

/// Smallest positive root of 1 + 3 k1 r + 5 k2 r^2, the derivative of the radial part (r is the squared
/// radius); infinity if there is none.
double squaredRadiusOfFold(double k1, double k2) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const double a = 5.0 * k2;
  const double b = 3.0 * k1;
  if (a == 0.0) {
    return b < 0.0 ? -1.0 / b : kInfinity;
  }
  const double discriminant = b * b - 4.0 * a;
  if (discriminant < 0.0) {
    return kInfinity;
  }
  // Numerically stable formula for both roots.
  const double q = -0.5 * (b + (b < 0.0 ? -1.0 : 1.0) * std::sqrt(discriminant));
  double smallest = kInfinity;
  for (const double root : {q / a, q != 0.0 ? 1.0 / q : kInfinity}) {
    if (root > 0.0) {
      smallest = std::min(smallest, root);
    }
  }
  return smallest;
}

}  // namespace

RadialTangentialDistortion::RadialTangentialDistortion(double k1, double k2, double p1, double p2)
    : k1_(k1), k2_(k2), p1_(p1), p2_(p2), max_radius_(std::sqrt(squaredRadiusOfFold(k1, k2))) {
  if (!(std::isfinite(k1) && std::isfinite(k2) && std::isfinite(p1) && std::isfinite(p2))) {
    throw std::invalid_argument("distortion: k1, k2, p1, p2 must be finite");
  }
}

bool RadialTangentialDistortion::distort(const Eigen::Vector2d& undistorted, Eigen::Vector2d* distorted,
                                         Eigen::Matrix2d* by_point,
                                         Eigen::Matrix<double, 2, 4>* by_parameters) const {
  const double x = undistorted.x();
  const double y = undistorted.y();
  const double r = x * x + y * y;  // squared radius, as in the paper
  if (!(r < max_radius_ * max_radius_)) {
    return false;
  }
  const double radial = 1.0 + r * (k1_ + k2_ * r);
  *distorted = Eigen::Vector2d(x * radial + 2.0 * p1_ * x * y + p2_ * (r + 2.0 * x * x),
                               y * radial + p1_ * (r + 2.0 * y * y) + 2.0 * p2_ * x * y);
  if (by_point != nullptr) {
    const double radial_by_r = k1_ + 2.0 * k2_ * r;
    const double cross = 2.0 * x * y * radial_by_r + 2.0 * p1_ * x + 2.0 * p2_ * y;
    *by_point << radial + 2.0 * x * x * radial_by_r + 2.0 * p1_ * y + 6.0 * p2_ * x, cross,  //
        cross, radial + 2.0 * y * y * radial_by_r + 6.0 * p1_ * y + 2.0 * p2_ * x;
  }
  if (by_parameters != nullptr) {
    *by_parameters << x * r, x * r * r, 2.0 * x * y, r + 2.0 * x * x,  //
        y * r, y * r * r, r + 2.0 * y * y, 2.0 * x * y;
  }
  return true;
}

bool RadialTangentialDistortion::undistort(const Eigen::Vector2d& distorted,
                                           Eigen::Vector2d* undistorted) const {
  if (isZero()) {
    *undistorted = distorted;
    return true;
  }
  const double distorted_radius = distorted.norm();
  if (!std::isfinite(distorted_radius)) {
    return false;
  }
  // The radial part alone grows up to max_radius_, so bisection finds a start from which Newton's method on
  // the full model converges.
  const auto radialPart = [&](double radius) {
    const double r = radius * radius;
    return radius * (1.0 + r * (k1_ + k2_ * r));
  };
  double low = 0.0;
  double high = std::min(max_radius_, std::max(1.0, 2.0 * distorted_radius));
  while (high < max_radius_ && radialPart(high) < distorted_radius) {
    low = high;
    high = std::min(max_radius_, 2.0 * high);
  }
  for (int i = 0; i < 12; ++i) {
    const double middle = 0.5 * (low + high);
    (radialPart(middle) < distorted_radius ? low : high) = middle;
  }
  Eigen::Vector2d point = distorted_radius > 0.0
                              ? Eigen::Vector2d(distorted * (0.5 * (low + high) / distorted_radius))
                              : distorted;

  constexpr int kMaxIterations = 30;
  constexpr double kConverged = 1e-14;
  for (int i = 0; i < kMaxIterations; ++i) {
    Eigen::Vector2d image;
    Eigen::Matrix2d jacobian;
    if (!distort(point, &image, &jacobian)) {
      return false;
    }
    const double determinant = jacobian.determinant();
    if (!(determinant > 0.0)) {
      return false;
    }
    const Eigen::Vector2d residual = distorted - image;
    Eigen::Vector2d step(jacobian(1, 1) * residual.x() - jacobian(0, 1) * residual.y(),
                         jacobian(0, 0) * residual.y() - jacobian(1, 0) * residual.x());
    step /= determinant;
    while (!((point + step).norm() < max_radius_)) {
      step *= 0.5;
      if (step.norm() < kConverged) {
        return false;
      }
    }
    point += step;
    if (step.norm() <= kConverged * (1.0 + point.norm())) {
      break;
    }
  }
  Eigen::Vector2d image;
  if (!distort(point, &image) || (image - distorted).norm() > 1e-11 * (1.0 + distorted_radius)) {
    return false;
  }
  *undistorted = point;
  return true;
}

}  // namespace vcharge
