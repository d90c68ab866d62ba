#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "vcharge_reconstruction/bundle_problem.h"

namespace ceres {
class CostFunction;
class Manifold;
}  // namespace ceres

namespace vcharge {

/// Values of the unknowns of a bundle adjustment at one iteration.
struct BundleState {
  std::vector<RigidTransform> poses;
  std::vector<Eigen::Vector3d> points;
  Eigen::Vector2d odometer = Eigen::Vector2d::Ones();
  std::vector<RigidTransform> vehicle_from_camera, camera_from_vehicle;
  std::vector<ImageDeviation> image_deviations;    ///< empty: none
  std::vector<TimingDeviation> timing_deviations;  ///< empty: none

  static BundleState of(const BundleProblem& problem);
  void moveCamera(size_t camera, const Eigen::Matrix<double, 6, 1>& move);
};

/// Error of an odometer factor over its standard deviation, with its derivatives.
struct OdometerError {
  Eigen::Matrix<double, 6, 1> error;
  Eigen::Matrix<double, 6, 6> by_previous, by_current;
  Eigen::Matrix<double, 6, 2> by_odometer;
};

/// The terms of a bundle adjustment's cost.
class BundleErrors {
 public:
  explicit BundleErrors(const BundleProblem& problem);
  ~BundleErrors();

  /// Reprojection error of an observation over its standard deviation, and its derivatives by the point and
  /// by the camera's ImageDeviation where these are not null. False where the camera does not project the
  /// point: the error is then large and constant.
  bool reprojection(const BundleState& state, const BundleObservation& observation,
                    const Eigen::Vector3d& point, Eigen::Vector2d* error,
                    Eigen::Matrix<double, 2, 3>* by_point,
                    Eigen::Matrix<double, 2, 3>* by_deviation = nullptr) const;
  /// Motion of the vehicle from a pose's instant to the exposure of an observation; none where both are the
  /// same.
  std::optional<RigidTransform> motionToExposure(const BundleState& state,
                                                 const BundleObservation& observation) const;
  /// Height of a point above the ground of a pose over its standard deviation, and the derivative by the
  /// point.
  double ground(const BundleState& state, const GroundObservation& observation,
                Eigen::RowVector3d* by_point) const;
  OdometerError odometerFactor(const BundleState& state, size_t factor) const;
  /// Deviation of the odometer's factors from 1, over their standard deviations.
  Eigen::Vector2d odometerPrior(const BundleState& state) const;
  /// Information of the prior of a point; zero without a prior.
  Eigen::Matrix3d pointInformation(size_t point) const {
    return problem_.point_information.empty() ? Eigen::Matrix3d::Zero().eval()
                                              : problem_.point_information[point];
  }
  /// Moves of the cameras from the prior of the extrinsics, [dt, dphi] of each; empty without a prior.
  Eigen::VectorXd cameraMoves(const BundleState& state) const;
  /// Difference of a camera's image deviation from its prior over the standard deviations.
  Eigen::Vector3d imageDeviationPrior(const BundleState& state, size_t camera) const;
  /// Likewise of the timing.
  Eigen::Vector2d timingDeviationPrior(const BundleState& state, size_t camera) const;
  /// Difference of the mean clock offset from that of its prior over the standard deviation.
  double commonClockPrior(const BundleState& state) const;

  /// Weight that linearizes the Cauchy loss at an error with this square.
  double robustWeight(double square) const { return 1.0 / (1.0 + square / squared_loss_scale_); }
  double robustCost(double square) const;

  /// Half of the sum of (robust) squares, in an order that does not depend on scheduling.
  double cost(const BundleState& state) const;

 private:
  const BundleProblem& problem_;
  const double squared_loss_scale_;
  const std::unique_ptr<const ceres::Manifold> manifold_;
  std::vector<Eigen::Vector2d> principal_points_px_;
  std::vector<std::unique_ptr<const ceres::CostFunction>> odometer_costs_;
};

}  // namespace vcharge
