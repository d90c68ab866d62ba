#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include <Eigen/Core>

#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_core/motion/rigid_transform.h"

namespace vcharge {

constexpr int32_t kGroundCamera = -1;

/// A point as a camera of the rig saw it; or, with camera kGroundCamera, one that lies on the ground, z = 0
/// in the vehicle's frame of a pose: then sigma_px is in metres and position_px of no use.
struct BundleObservation {
  int32_t pose = 0;
  int32_t camera = 0;
  Eigen::Vector2d position_px = Eigen::Vector2d::Zero();
  double sigma_px = 1.0;
};

/// The planar motion from the pose before to `pose` as an odometer counted it, and the information of
/// makeOdometryCost().
struct BundleMotion {
  int32_t pose = 0;
  RigidTransform previous_from_current;
  Eigen::Matrix<double, 6, 6> information = Eigen::Matrix<double, 6, 6>::Zero();
};

/// Poses of a rig, points and an odometer's factors, to be moved to the least sum of errors.
struct BundleProblem {
  std::shared_ptr<const CameraRig> rig;
  std::vector<RigidTransform> map_from_vehicle;  ///< the first is held
  std::vector<Eigen::Vector3d> points_in_map;
  Eigen::Vector2d odometer = Eigen::Vector2d::Ones();  ///< true over counted distance, and turn
  std::vector<BundleObservation> observations;         ///< grouped by point, by pose within a point
  std::vector<size_t> first_observation;               ///< of every point, and the number of all at the end
  std::vector<BundleMotion> motions;
  Eigen::Vector2d odometer_sigmas = Eigen::Vector2d::Ones();  ///< of the factors, before the drive; around 1
  double loss_sigmas = 2.0;                                   ///< scale of the Cauchy loss of observations
  /// How well each point is known beforehand to be where it begins, 1/m^2 along the map's axes. Empty: not at
  /// all.
  std::vector<Eigen::Matrix3d> point_information;

  // For calibration. Empty: the cameras are where the rig says.
  std::vector<RigidTransform> vehicle_from_camera;  ///< unknown too, one per camera of the rig
  /// How well the cameras are known beforehand to be, in the mean, where they begin: information on the
  /// motion of all of them together, as one rigid body, [dt, dphi] in the vehicle's frame.
  Eigen::Matrix<double, 6, 6> common_information = Eigen::Matrix<double, 6, 6>::Zero();
};

struct BundleSolution {
  bool converged = false;
  int num_iterations = 0;
  double cost = 0.0;  ///< half of the sum of (robust) squares
};

/// Levenberg-Marquardt on the reduced system of the poses (Schur complement of the points), factorized by
/// CHOLMOD. Parallel over points and over poses with sums in a fixed order: the same result on any number of
/// threads. The robust loss acts as a weight that is computed anew at every iteration.
/// `max_iterations` and the relative decrease of the cost that ends them.
BundleSolution solveBundle(int max_iterations, double cost_tolerance, BundleProblem* problem);

/// What an adjusted problem tells of the odometer's factors and the cameras: columns and rows [distance,
/// turn, then dt, dphi of each camera].
struct BundleCovariance {
  bool is_valid = false;  ///< false where something is not observable at all
  /// As the errors' standard deviations are said to be, and independent (Schur complement).
  Eigen::MatrixXd covariance;
  /// What each pose's errors (its observations, and its motion) contributed to the unknowns: one column per
  /// pose. Sums over parts of a drive show how the unknowns would differ without them: a jackknife.
  Eigen::MatrixXd influence;
};
BundleCovariance bundleCovariance(const BundleProblem& problem);

}  // namespace vcharge
