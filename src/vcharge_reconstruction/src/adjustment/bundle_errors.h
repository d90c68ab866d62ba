#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include <Eigen/Core>

#include "vcharge_reconstruction/bundle_solver.h"

namespace ceres {
class CostFunction;
class Manifold;
}  // namespace ceres

namespace vcharge {

/// Poses, points and the odometer's factors at one instant of the iteration.
struct BundleState {
  std::vector<RigidTransform> poses;
  std::vector<Eigen::Vector3d> points;
  Eigen::Vector2d odometer = Eigen::Vector2d::Ones();
  std::vector<RigidTransform> vehicle_from_camera, camera_from_vehicle;

  static BundleState of(const BundleProblem& problem);
  void moveCamera(size_t camera, const Eigen::Matrix<double, 6, 1>& move);
};

/// An odometry error over its deviation, and its derivatives by the pose before, the pose, and the factors.
struct MotionError {
  Eigen::Matrix<double, 6, 1> error;
  Eigen::Matrix<double, 6, 6> by_previous, by_current;
  Eigen::Matrix<double, 6, 2> by_odometer;
};

/// The errors that a bundle adjustment makes small.
class BundleErrors {
 public:
  explicit BundleErrors(const BundleProblem& problem);
  ~BundleErrors();

  /// Error of an observation over its deviation, and its derivative by the point where it is not null. False
  /// where the camera cannot see the point: then the error is large, and flat.
  bool ofObservation(const BundleState& state, size_t observation, const Eigen::Vector3d& point,
                     Eigen::Vector2d* error, Eigen::Matrix<double, 2, 3>* by_point) const;
  /// Weight of an observation whose error has this square.
  double robustWeight(double square) const { return 1.0 / (1.0 + square / squared_loss_scale_); }
  double robustCost(double square) const;

  /// Of what is known of a point beforehand.
  Eigen::Matrix3d priorInformation(size_t point) const {
    return problem_.point_information.empty() ? Eigen::Matrix3d::Zero().eval()
                                              : problem_.point_information[point];
  }

  MotionError ofMotion(const BundleState& state, size_t motion) const;
  Eigen::Vector2d ofOdometer(const BundleState& state) const;
  /// How far the cameras moved as one rigid body, [dt, dphi]; zero where they are known.
  Eigen::Matrix<double, 6, 1> commonMotion(const BundleState& state) const;
  /// Derivative of commonMotion() by the motion of a camera.
  Eigen::Matrix<double, 6, 6> commonMotionByCamera(size_t camera) const;

  /// Half of the sum of (robust) squares, added up in an order that no scheduling changes.
  double cost(const BundleState& state) const;

 private:
  const BundleProblem& problem_;
  const double squared_loss_scale_;
  const std::unique_ptr<const ceres::Manifold> manifold_;
  std::vector<std::unique_ptr<const ceres::CostFunction>> motion_costs_;
};

}  // namespace vcharge
