#include "vcharge_localization/pose_filter.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>

#include "vcharge_core/base/error.h"
#include "vcharge_core/motion/cross_matrix.h"
#include "vcharge_core/motion/pose_step.h"

namespace vcharge {
namespace {

// Odometer noise that depends little on the car: random walk of the factors, and heights and tilts of
// the road per metre, heading noise per radian of turn, and drift per second, all per square root.
constexpr double kFactorWalk = 0.001;
constexpr double kYawTurnSigma = 0.01;
constexpr double kHeightSigma_m = 0.01;
constexpr double kTiltSigma_rad = 0.003;
constexpr double kTimeSigma_m = 0.002;
constexpr double kTimeSigma_rad = 0.0005;

/// Weight of a fix in the mean over the last ones: about as many as in four seconds.
constexpr double kConsistencyGain = 0.02;
// A mean beyond these says more about the filter's model than about the place.
constexpr double kMinConsistency = 0.1;
constexpr double kMaxConsistency = 10.0;

double squared(double value) {
  return value * value;
}

Eigen::Matrix<double, 6, 6> mapCovarianceAt(const PoseFix& fix) {
  return fix.map_variance_ratio * fix.covariance;
}

}  // namespace

PoseFilter::PoseFilter(const PoseFilterOptions& options) : options_(options) {
  options_.validate();
  covariance_(6, 6) = squared(options_.scale_sigma);
  covariance_(7, 7) = squared(options_.turn_sigma);
}

PosePrior PoseFilter::pose() const {
  check(has_pose_, "PoseFilter::pose: nothing is known yet");
  return {map_from_vehicle_, scaled_.topLeftCorner<6, 6>() + consistency_ * map_covariance_};
}

PosePrior PoseFilter::prediction() const {
  check(has_pose_, "PoseFilter::prediction: nothing is known yet");
  return {map_from_vehicle_, covariance_.topLeftCorner<6, 6>() + map_covariance_};
}

void PoseFilter::reset(const PosePrior& pose) {
  has_pose_ = true;
  map_from_vehicle_ = pose.map_from_vehicle;
  covariance_.topRows<6>().setZero();
  covariance_.leftCols<6>().setZero();
  covariance_.topLeftCorner<6, 6>() = pose.covariance;
  scaled_ = covariance_;
  consistency_ = 1.0;
  map_covariance_.setZero();
}

void PoseFilter::reset(const PoseFix& fix) {
  reset(PosePrior{fix.map_from_vehicle, options_.fix_covariance_factor * fix.covariance});
  map_covariance_ = mapCovarianceAt(fix);
}

void PoseFilter::propagate(const Matrix8d& by_state, const Matrix6d& noise, double factor_noise,
                           Matrix8d* covariance) {
  *covariance = by_state * *covariance * by_state.transpose();
  covariance->topLeftCorner<6, 6>() += noise;
  covariance->diagonal().tail<2>().array() += factor_noise;
}

void PoseFilter::predict(const RigidTransform& previous_from_current, double period_s) {
  if (!has_pose_) {
    return;
  }
  const double distance_m = previous_from_current.translation().norm();
  const double turn_rad = yawOfRotation(previous_from_current.rotation());
  // A correction of the turn rotates the chord by half of it, as in the adjustment of maps.
  const Eigen::Matrix3d bend =
      Eigen::AngleAxisd(0.5 * (factors_[1] - 1.0) * turn_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  const Eigen::Vector3d counted = bend * previous_from_current.translation();
  const Eigen::Vector3d moved = factors_[0] * counted;
  const Eigen::Quaterniond turned =
      previous_from_current.rotation() *
      Eigen::AngleAxisd((factors_[1] - 1.0) * turn_rad, Eigen::Vector3d::UnitZ());
  const Eigen::Matrix3d rotation = map_from_vehicle_.rotationMatrix();
  const Eigen::Vector3d moved_in_map = rotation * moved;
  map_from_vehicle_ =
      RigidTransform(map_from_vehicle_.rotation() * turned, map_from_vehicle_.translation() + moved_in_map);

  Matrix8d by_state = Matrix8d::Identity();
  by_state.block<3, 3>(0, 3) = -crossMatrix(moved_in_map);
  by_state.block<3, 1>(0, 6) = rotation * counted;
  by_state.block<3, 1>(0, 7) = 0.5 * turn_rad * (rotation * Eigen::Vector3d(-moved.y(), moved.x(), 0.0));
  by_state.block<3, 1>(3, 7) = turn_rad * rotation.col(2);
  Eigen::Matrix<double, 6, 1> variances;
  const double planar = squared(options_.distance_sigma) * distance_m;
  const double tilt = squared(kTiltSigma_rad) * distance_m;
  variances << planar, planar, squared(kHeightSigma_m) * distance_m, tilt, tilt,
      squared(options_.yaw_sigma_rad) * distance_m + squared(kYawTurnSigma) * std::abs(turn_rad);
  variances.head<3>().array() += squared(kTimeSigma_m) * period_s;
  variances.tail<3>().array() += squared(kTimeSigma_rad) * period_s;
  Matrix6d noise = Matrix6d::Zero();
  noise.topLeftCorner<3, 3>() = rotation * variances.head<3>().asDiagonal() * rotation.transpose();
  noise.bottomRightCorner<3, 3>() = rotation * variances.tail<3>().asDiagonal() * rotation.transpose();
  for (Matrix8d* const covariance : {&covariance_, &scaled_}) {
    propagate(by_state, noise, squared(kFactorWalk) * distance_m, covariance);
  }
}

void PoseFilter::addNoise(double sigma_m, double sigma_rad) {
  for (Matrix8d* const covariance : {&covariance_, &scaled_}) {
    covariance->diagonal().head<3>().array() += squared(sigma_m);
    covariance->diagonal().segment<3>(3).array() += squared(sigma_rad);
  }
}

Eigen::Matrix<double, 6, 1> PoseFilter::differenceTo(const RigidTransform& map_from_vehicle) const {
  return stepBetween(map_from_vehicle_, map_from_vehicle);
}

PoseFilter::Matrix6d PoseFilter::noiseOf(const PoseFix& fix) const {
  return options_.fix_covariance_factor * fix.covariance + mapCovarianceAt(fix);
}

double PoseFilter::distanceOf(const PoseFix& fix) const {
  const Matrix6d expected = covariance_.topLeftCorner<6, 6>() + noiseOf(fix);
  const Eigen::Matrix<double, 6, 1> difference = differenceTo(fix.map_from_vehicle);
  return difference.dot(expected.ldlt().solve(difference));
}

bool PoseFilter::update(const PoseFix& fix) {
  check(has_pose_, "PoseFilter::update: nothing is known yet");
  if (!(distanceOf(fix) <= options_.gate)) {
    return false;
  }
  // The error of the map is common to the fix and the prediction.
  const Matrix6d visible =
      covariance_.topLeftCorner<6, 6>() + options_.fix_covariance_factor * fix.covariance;
  const Eigen::Matrix<double, 6, 1> difference = differenceTo(fix.map_from_vehicle);
  const double distance = difference.dot(visible.ldlt().solve(difference));
  constexpr double kExpectedDistance = 6.0;  // of a chi-square distribution with the degrees of freedom
  consistency_ =
      std::clamp((1.0 - kConsistencyGain) * consistency_ + kConsistencyGain * distance / kExpectedDistance,
                 kMinConsistency, kMaxConsistency);
  map_covariance_ = mapCovarianceAt(fix);
  const Matrix6d noise = noiseOf(fix);
  const Matrix6d expected = covariance_.topLeftCorner<6, 6>() + noise;
  const Eigen::Matrix<double, 8, 6> gain = expected.ldlt().solve(covariance_.topRows<6>()).transpose();
  const Eigen::Matrix<double, 8, 1> change = gain * differenceTo(fix.map_from_vehicle);
  map_from_vehicle_ = moved(map_from_vehicle_, change.head<6>());
  factors_ += change.tail<2>();
  // Joseph's form keeps the covariance symmetric and positive.
  Matrix8d keep = Matrix8d::Identity();
  keep.leftCols<6>() -= gain;
  covariance_ = keep * covariance_ * keep.transpose() + gain * noise * gain.transpose();
  scaled_ = consistency_ * covariance_;
  return true;
}

}  // namespace vcharge
