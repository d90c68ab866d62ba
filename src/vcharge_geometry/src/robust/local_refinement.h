#pragma once

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/Core>

#include "vcharge_core/motion/rigid_transform.h"
#include "vcharge_geometry/solvers/rotation_translation.h"

namespace vcharge {

using Matrix6d = Eigen::Matrix<double, 6, 6>;
using Vector6d = Eigen::Matrix<double, 6, 1>;

/// Sums over all matches for Tukey's biweight with truncation c: rho(e) = c^2/6 (1 - (1 - u)^3), u = e^2/c^2
/// below 1. Each residual has `dimensions` components with equal, independent noise.
class RobustSums {
 public:
  explicit RobustSums(double truncation) : truncation_squared_(truncation * truncation) {}

  /// Weight of a residual in the normal equations; 0 beyond the truncation.
  double addResidual(double squared, int dimensions) {
    const double u = squared / truncation_squared_;
    if (!(u < 1.0)) {
      cost += truncation_squared_ / 6.0;
      return 0.0;
    }
    const double one_minus = 1.0 - u;
    const double weight = one_minus * one_minus;
    cost += truncation_squared_ / 6.0 * (1.0 - weight * one_minus);
    num_components += dimensions;
    squared_sum += squared;
    influence_squared_sum += weight * weight * squared;
    influence_slope_sum += one_minus * (dimensions * one_minus - 4.0 * u);
    return weight;
  }

  double cost = 0.0;
  int num_components = 0;                  ///< components of the inliers' residuals
  double squared_sum = 0.0;                ///< sum of the squared residuals of the inliers
  double influence_squared_sum = 0.0;      ///< sum of the squared first derivatives of rho
  double influence_slope_sum = 0.0;        ///< sum of the traces of the second derivative of rho
  Matrix6d weighted = Matrix6d::Zero();    ///< sum of w J^T J
  Matrix6d unweighted = Matrix6d::Zero();  ///< sum of J^T J over the inliers
  Vector6d gradient = Vector6d::Zero();    ///< sum of w J^T e

 private:
  double truncation_squared_;
};

/// Motion on a circle around a point on the rear axle: parameters [distance, yaw].
struct AckermannParameters {
  static constexpr int kSize = 2;
  static Eigen::Matrix<double, 6, 2> basis(const RotationTranslation& model) {
    const double half = 0.5 * std::atan2(model.rotation(1, 0), model.rotation(0, 0));
    const double distance =
        model.translation_m.x() * std::cos(half) + model.translation_m.y() * std::sin(half);
    Eigen::Matrix<double, 6, 2> basis;
    basis.col(0) << std::cos(half), std::sin(half), 0.0, 0.0, 0.0, 0.0;
    basis.col(1) << -0.5 * distance * std::sin(half), 0.5 * distance * std::cos(half), 0.0, 0.0, 0.0, 1.0;
    return basis;
  }
  static RotationTranslation moved(const RotationTranslation& model, const Eigen::Vector2d& step) {
    const double yaw = std::atan2(model.rotation(1, 0), model.rotation(0, 0));
    const double distance = model.translation_m.x() * std::cos(0.5 * yaw) +
                            model.translation_m.y() * std::sin(0.5 * yaw) + step[0];
    const double half = 0.5 * (yaw + step[1]);
    return RotationTranslation(
        RigidTransform::planar(distance * std::cos(half), distance * std::sin(half), 2.0 * half));
  }
};

/// Parameters [x, y, yaw], [x, y, z, yaw] or [x, y, z, phi], which are rows of [dt, dphi].
template <int Size>
struct CartesianParameters {
  static_assert(Size == 3 || Size == 4 || Size == 6, "planar, upright or free motion");
  static constexpr int kSize = Size;
  static Eigen::Matrix<double, 6, Size> basis(const RotationTranslation& /*model*/) {
    Eigen::Matrix<double, 6, Size> basis = Eigen::Matrix<double, 6, Size>::Zero();
    for (int i = 0; i < Size; ++i) {
      basis(Size < 6 && i == Size - 1 ? 5 : i, i) = 1.0;
    }
    return basis;
  }
  static RotationTranslation moved(const RotationTranslation& model,
                                   const Eigen::Matrix<double, Size, 1>& step) {
    const Vector6d full = basis(model) * step;
    RotationTranslation result;
    result.rotation = (rotationFromVector(full.tail<3>()) * Eigen::Quaterniond(model.rotation))
                          .normalized()
                          .toRotationMatrix();
    result.translation_m = model.translation_m + full.head<3>();
    return result;
  }
};

/// Robust cost of a model: that of RobustSums, without Jacobians.
template <class Problem>
double robustCost(const Problem& problem, const RotationTranslation& model, double truncation_rad) {
  RobustSums sums(truncation_rad);
  for (size_t i = 0; i < problem.qualities().size(); ++i) {
    sums.addResidual(problem.squaredError(model, static_cast<int>(i)), Problem::kDimensions);
  }
  return sums.cost;
}

/// Levenberg-Marquardt on the robust cost of a problem for estimateRobustly(), which also has `kDimensions`,
/// the size of a residual, and `sums(model, truncation_rad)`, RobustSums with Jacobians over [dt, dphi].
/// Never returns a model of higher cost than the initial one.
template <class Parameters, class Problem>
RotationTranslation refineLocally(const Problem& problem, const RotationTranslation& start,
                                  double truncation_rad, int max_steps) {
  constexpr int kSize = Parameters::kSize;
  RotationTranslation model = start;
  double damping = 1e-4;
  for (int step = 0; step < max_steps; ++step) {
    const RobustSums current = problem.sums(model, truncation_rad);
    const Eigen::Matrix<double, 6, kSize> basis = Parameters::basis(model);
    const Eigen::Matrix<double, kSize, kSize> hessian = basis.transpose() * current.weighted * basis;
    const Eigen::Matrix<double, kSize, 1> gradient = basis.transpose() * current.gradient;
    bool improved = false;
    bool converged = false;
    for (int attempt = 0; attempt < 5 && !improved && !converged; ++attempt) {
      Eigen::Matrix<double, kSize, kSize> damped = hessian;
      // The absolute term keeps an unobservable scale unchanged.
      damped.diagonal() += damping * hessian.diagonal() +
                           Eigen::Matrix<double, kSize, 1>::Constant(1e-12 * hessian.trace() + 1e-300);
      const Eigen::Matrix<double, kSize, 1> change = -damped.ldlt().solve(gradient);
      if (!change.allFinite()) {
        return model;
      }
      const RotationTranslation candidate = Parameters::moved(model, change);
      const double candidate_cost = robustCost(problem, candidate, truncation_rad);
      converged = change.norm() < 1e-12;
      if (candidate_cost < current.cost) {
        model = candidate;
        converged = converged || current.cost - candidate_cost < 1e-9 * current.cost;
        improved = true;
        damping = std::max(1e-9, 0.1 * damping);
      } else {
        damping *= 10.0;
      }
    }
    if (!improved || converged) {
      break;
    }
  }
  return model;
}

/// Covariance of the M-estimate over [dt, dphi] (Huber, "Robust Statistics", 1981, section 7.6): the mean
/// squared influence over its squared mean slope, times the inverse of J^T J. Zero in directions that the
/// parameters exclude, 1e12 in unobserved directions.
template <class Parameters>
Matrix6d estimateCovariance(const RobustSums& sums, const RotationTranslation& model) {
  const Eigen::Matrix<double, 6, Parameters::kSize> basis = Parameters::basis(model);
  Eigen::Matrix<double, Parameters::kSize, Parameters::kSize> information =
      basis.transpose() * sums.unweighted * basis;
  const double degrees_of_freedom = std::max(1, sums.num_components - Parameters::kSize);
  const double mean_slope = std::max(0.05, sums.influence_slope_sum / std::max(1, sums.num_components));
  const double variance =
      std::max(1e-30, sums.influence_squared_sum / degrees_of_freedom / (mean_slope * mean_slope));
  information /= variance;
  information.diagonal().array() += 1e-12;
  return basis * information.ldlt().solve(basis.transpose());
}

}  // namespace vcharge
