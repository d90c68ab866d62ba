#pragma once

#include <optional>

#include <Eigen/Core>

#include "vcharge_core/base/options.h"
#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_core/motion/rigid_transform.h"
#include "vcharge_reconstruction/map_localizer.h"

namespace vcharge {

/// Options of PoseFilter. Odometry errors are standard deviations per square root of the distance or turn.
struct PoseFilterOptions {
  VCHARGE_BEGIN_OPTIONS(PoseFilterOptions);
  VCHARGE_OPTION(double, scale_sigma, 0.02, notNegative(), "Sigma of true over counted distance.");
  VCHARGE_OPTION(double, turn_sigma, 0.02, notNegative(), "Sigma of true over counted turn.");
  VCHARGE_OPTION(double, distance_sigma, 0.01, notNegative(), "Position noise after a metre, in metres.");
  VCHARGE_OPTION(double, yaw_sigma_rad, 0.0012, notNegative(), "Heading noise after a metre.");
  VCHARGE_OPTION(double, fix_covariance_factor, 3.0, positive(), "Factor on the covariance of a fix.");
  VCHARGE_OPTION(double, gate, 30.0, positive(), "Largest squared Mahalanobis distance of a fix.");
  VCHARGE_END_OPTIONS();
};

/// Fuses fixes with odometry: an error-state Kalman filter over the vehicle's pose in the map and the
/// odometer's factors. Intervals without fixes therefore use factors that were estimated from earlier
/// fixes.
///
/// Successive fixes have the error of the map in common, which averaging does not reduce. It is added to the
/// covariance that pose() returns. A drive that made the map saw the place about as well as the last fix, so
/// that the map's error has the covariance of that fix, divided by the number of these drives.
///
/// How accurate fixes are depends on the place, the light and the map. pose() therefore scales the covariance
/// at the last fix by how far the last fixes were from their predictions, relative to what the covariances
/// (without the map's, which both have in common) let expect: covariance matching, Mehra, IEEE Trans.
/// Automatic Control 17(5), 1972. What predict() added since then is not scaled.
class PoseFilter {
 public:
  explicit PoseFilter(const PoseFilterOptions& options = PoseFilterOptions());

  bool hasPose() const { return has_pose_; }
  /// std::logic_error before the first reset().
  PosePrior pose() const;
  /// The same pose with the covariance that does not depend on the last fixes' distances: where to search.
  PosePrior prediction() const;
  double distanceScale() const { return factors_[0]; }
  double turnScale() const { return factors_[1]; }

  /// Replaces the pose and keeps the odometer's factors.
  void reset(const PosePrior& pose);
  void reset(const PoseFix& fix);
  void forget() { has_pose_ = false; }

  /// Predicts the pose after a motion measured by the odometer.
  void predict(const RigidTransform& previous_from_current, double period_s);

  /// Adds uncertainty for motion that the odometer did not measure.
  void addNoise(double sigma_m, double sigma_rad);

  /// Squared Mahalanobis distance between a fix and the predicted pose.
  double distanceOf(const PoseFix& fix) const;
  /// Corrects the pose by a fix. Returns false, without an effect, for a fix beyond the gate.
  bool update(const PoseFix& fix);

 private:
  using Matrix6d = Eigen::Matrix<double, 6, 6>;
  using Matrix8d = Eigen::Matrix<double, 8, 8>;

  /// Moves a covariance through a motion, given the derivative of the next state by this one.
  static void propagate(const Matrix8d& by_state, const Matrix6d& noise, double factor_noise,
                        Matrix8d* covariance);
  Matrix6d noiseOf(const PoseFix& fix) const;
  Eigen::Matrix<double, 6, 1> differenceTo(const RigidTransform& map_from_vehicle) const;

  PoseFilterOptions options_;
  bool has_pose_ = false;
  RigidTransform map_from_vehicle_;
  Eigen::Vector2d factors_ = Eigen::Vector2d::Ones();  ///< ratios of true to measured distance and turn
  Matrix8d covariance_ = Matrix8d::Zero();             ///< [dt, dphi] in the map's frame, factors
  Matrix8d scaled_ = Matrix8d::Zero();                 ///< the same, scaled at the last fix
  Matrix6d map_covariance_ = Matrix6d::Zero();         ///< at the last fix
  double consistency_ = 1.0;                           ///< mean distance of fixes over the expected one
};

}  // namespace vcharge
