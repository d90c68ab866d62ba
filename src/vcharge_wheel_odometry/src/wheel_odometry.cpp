#include "vcharge_wheel_odometry/wheel_odometry.h"

#include <algorithm>
#include <cmath>

#include "vcharge_core/base/error.h"

namespace vcharge {
namespace {

// Errors of successive counts are correlated: this many of them count as one measurement.
constexpr double kCountsPerIndependentOne = 4.0;
// Straight ahead both wheels tick at one rate, so the error of their difference changes over about this time.
constexpr double kDifferenceCorrelation_s = 1.0;
constexpr double kYawNoise_rad = 2e-4;     // error of the bicycle model, per root of a second
constexpr double kZeroNoise_per_m = 3e-5;  // drift of the steering's zero, per root of a second
constexpr double kZeroSigma_per_m = 0.01;  // initial standard deviation: 1.5 degrees of steering
constexpr double kSteeredYawAcceleration =
    1.0;  // rad/s^2 per root of a second, beyond what the steering explains
constexpr double kYawRateFloor_rad_per_s = 1e-3;
constexpr double kSlipWindow_s = 0.5;   // period in which wheels and steering are compared
constexpr double kSlipFraction = 0.25;  // fraction of the turn: steering angles are less exact in tight turns
constexpr double kStandstill_s = 0.3;   // time without a tick
// Tyres transmit forces by rolling up to this fraction faster or slower than the car moves.
constexpr double kTyreSlip = 0.05;
// At this speed, a car that understeers turns half as much as its front wheels are steered; the effect grows
// with the square of the speed. A low value among passenger cars.
constexpr double kCharacteristicSpeed_m_per_s = 18.0;
constexpr double kMaxSteeringAngle_rad = 1.3;  // no car steers farther
constexpr double kMinSpeedOfCurvature_m_per_s = 0.5;
constexpr double kMaxUncertainGap_s = 60.0;  // the uncertainty of a longer gap grows no more

double square(double value) {
  return value * value;
}

template <int kSize>
void kalmanUpdate(const Eigen::Matrix<double, 1, kSize>& row, double innovation, double variance,
                  Eigen::Matrix<double, kSize, 1>* state, Eigen::Matrix<double, kSize, kSize>* covariance) {
  const Eigen::Matrix<double, kSize, 1> column = *covariance * row.transpose();
  const Eigen::Matrix<double, kSize, 1> gain = column / ((row * column).value() + variance);
  *state += gain * innovation;
  *covariance -= gain * column.transpose();
  *covariance = 0.5 * (*covariance + covariance->transpose()).eval();
}

/// Fraction of the steered turn by which the car may turn less.
double understeer(double speed_m_per_s) {
  return std::min(1.0, square(speed_m_per_s / kCharacteristicSpeed_m_per_s));
}

}  // namespace

WheelOdometry::WheelOdometry(const WheelOdometryOptions& options) : options_(options) {
  options.validate();
  along_covariance_ = Eigen::Vector2d(0.0, 1.0).asDiagonal();
  turn_covariance_ = Eigen::Vector3d(0.0, 0.1, square(kZeroSigma_per_m)).asDiagonal();
}

WheelOdometry::Steering WheelOdometry::steeringOf(const WheelMeasurement& wheels) {
  const double angle_rad = std::visit([](const auto& each) { return each.steering_angle_rad; }, wheels);
  if (!options_.use_steering || !(std::abs(angle_rad) < kMaxSteeringAngle_rad)) {  // unknown, which is NaN
    steering_.clear();
    return {};
  }
  const Timestamp stamp = stampOf(wheels);
  const double told = std::tan(angle_rad) / options_.wheelbase_m;
  const auto lag = durationFromSeconds(options_.steering_lag_s);
  steering_.emplace_back(stamp, told);
  while (steering_.size() > 1 && steering_[1].first <= stamp - lag) {
    steering_.pop_front();
  }
  // The steering goes on turning as during the last lag. A lag may be half as long or half as long again.
  const double since_s = toSeconds(stamp - steering_.front().first);
  const double change =
      since_s > 0.0 ? (told - steering_.front().second) * options_.steering_lag_s / since_s : 0.0;
  return {true, told + change,
          std::hypot(options_.steering_noise_per_m, 0.5 * change) + understeer(along_[1]) * std::abs(told)};
}

void WheelOdometry::predict(double dt_s, const Steering& steering) {
  steered_yaw_rad_ +=
      (steering.is_known ? along_[1] * (steering.curvature_per_m + turn_[2]) : turn_[1]) * dt_s;
  Eigen::Matrix2d along = Eigen::Matrix2d::Identity();
  along(0, 1) = dt_s;
  along_ = along * along_;
  along_covariance_ = along * along_covariance_ * along.transpose();
  // White acceleration: Bar-Shalom, Li, Kirubarajan, Estimation with Applications to Tracking, 6.2.2.
  const auto addWhiteAcceleration = [dt_s](double strength, auto* covariance) {
    (*covariance)(0, 0) += strength * dt_s * dt_s * dt_s / 3.0;
    (*covariance)(0, 1) += strength * dt_s * dt_s / 2.0;
    (*covariance)(1, 0) += strength * dt_s * dt_s / 2.0;
    (*covariance)(1, 1) += strength * dt_s;
  };
  addWhiteAcceleration(square(options_.max_acceleration_m_per_s2), &along_covariance_);

  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
  turn(0, 1) = dt_s;
  turn_ = turn * turn_;
  turn_covariance_ = turn * turn_covariance_ * turn.transpose();
  addWhiteAcceleration(
      square(steering.is_known ? kSteeredYawAcceleration : options_.max_yaw_acceleration_rad_per_s2),
      &turn_covariance_);
  turn_covariance_(0, 0) += square(kYawNoise_rad) * dt_s;
  turn_covariance_(2, 2) += square(kZeroNoise_per_m) * dt_s;
}

void WheelOdometry::addMotion(const WheelMotion& motion) {
  left_m_ += motion.left_m;
  right_m_ += motion.right_m;
  // Without front wheels, nothing contradicts the rear wheels.
  front_left_m_ += motion.has_front_wheels ? motion.front_left_m : motion.left_m;
  front_right_m_ += motion.has_front_wheels ? motion.front_right_m : motion.right_m;
  if (left_slips_ && motion.has_front_wheels) {
    left_excess_m_ += motion.left_m - motion.front_left_m;
  }
  if (right_slips_ && motion.has_front_wheels) {
    right_excess_m_ += motion.right_m - motion.front_right_m;
  }
}

// The car may have accelerated and braked, or turned, in a gap.
void WheelOdometry::addGap(double gap_s) {
  const double factor_s2 = square(std::min(gap_s, kMaxUncertainGap_s)) / 4.0;
  pose_covariance_.topLeftCorner<2, 2>().diagonal().array() +=
      square(options_.max_acceleration_m_per_s2 * factor_s2);
  pose_covariance_(2, 2) += square(std::min(M_PI, options_.max_yaw_acceleration_rad_per_s2 * factor_s2));
}

// Takes back what a slip moved before it was found, and the change of the speed that came with it. The yaw
// follows single wheels too slowly to be changed much.
void WheelOdometry::takeBack(double left_excess_m, double right_excess_m, double speed_before_m_per_s) {
  left_excess_m_ += left_excess_m;
  right_excess_m_ += right_excess_m;
  along_[0] -= 0.5 * (left_excess_m + right_excess_m);
  along_[1] = speed_before_m_per_s;
  along_covariance_(0, 1) = along_covariance_(1, 0) = 0.0;
  along_covariance_(1, 1) = 1.0;
}

void WheelOdometry::checkSlip(const Sample& sample, bool has_front_wheels, bool is_steered) {
  window_.push_back(sample);
  while (toSeconds(sample.stamp - window_.front().stamp) > kSlipWindow_s) {
    window_.pop_front();
  }
  const Sample& first = window_.front();
  const double left_m = sample.left_m - first.left_m;
  const double right_m = sample.right_m - first.right_m;
  const double steered_rad = sample.steered_yaw_rad - first.steered_yaw_rad;
  const double before_m = first.speed_m_per_s * toSeconds(sample.stamp - first.stamp);
  const double half_turn_m = 0.5 * steered_rad * options_.track_width_m;
  const double left_error_m = std::abs(left_m - (before_m - half_turn_m));
  const double right_error_m = std::abs(right_m - (before_m + half_turn_m));
  bool left_slips = false;
  bool right_slips = false;
  if (has_front_wheels) {
    const double front_left_m = sample.front_left_m - first.front_left_m;
    const double front_right_m = sample.front_right_m - first.front_right_m;
    const double limit_m = options_.slip_yaw_rad * options_.track_width_m;
    // The wheel that slips is the one that changed its speed more.
    left_slips = std::abs(left_m - front_left_m) > std::max(limit_m, kTyreSlip * std::abs(front_left_m)) &&
                 left_error_m > std::abs(front_left_m - (before_m - half_turn_m));
    right_slips =
        std::abs(right_m - front_right_m) > std::max(limit_m, kTyreSlip * std::abs(front_right_m)) &&
        right_error_m > std::abs(front_right_m - (before_m + half_turn_m));
    if ((left_slips && !left_slips_) || (right_slips && !right_slips_)) {
      const double left_excess_m = left_slips && !left_slips_ ? left_m - front_left_m : 0.0;
      const double right_excess_m = right_slips && !right_slips_ ? right_m - front_right_m : 0.0;
      takeBack(left_excess_m, right_excess_m, first.speed_m_per_s);
    }
  } else if (is_steered) {
    const double wheels_rad = (right_m - left_m) / options_.track_width_m;
    const double fraction = kSlipFraction + understeer(sample.speed_m_per_s);
    if (std::abs(wheels_rad - steered_rad) >
        std::max(options_.slip_yaw_rad, fraction * std::abs(steered_rad))) {
      // The slipping wheel changed its speed more than a car can.
      left_slips = counts_.slipping ? left_slips_ : left_error_m > right_error_m;
      right_slips = !left_slips;
    }
  }
  const bool slips = left_slips || right_slips;
  counts_.slips += slips && !counts_.slipping ? 1 : 0;
  counts_.slipping = slips;
  left_slips_ = left_slips;
  right_slips_ = right_slips;
}

void WheelOdometry::correct(const WheelMotion& motion, const Steering& steering) {
  const double left_m = left_m_;
  const double right_m = right_m_;
  const bool is_blind = counts_.slipping && !motion.has_front_wheels;
  if (is_blind) {
    // The position of the slipping wheel follows from the other wheel and the steering.
    const double apart_m = options_.track_width_m * turn_[0];
    (left_slips_ ? left_excess_m_ : right_excess_m_) = left_slips_
                                                           ? left_m - (right_m - right_excess_m_ - apart_m)
                                                           : right_m - (left_m - left_excess_m_ + apart_m);
  }
  const double left = left_m - left_excess_m_;
  const double right = right_m - right_excess_m_;
  const double count_variance = kCountsPerIndependentOne * square(motion.resolution_m) / 12.0;
  kalmanUpdate<2>(Eigen::RowVector2d(1.0, 0.0), 0.5 * (left + right) - along_[0], 0.5 * count_variance,
                  &along_, &along_covariance_);
  if (steering.is_known) {
    const double speed = along_[1];
    kalmanUpdate<3>(Eigen::RowVector3d(0.0, 1.0, -speed),
                    speed * steering.curvature_per_m - (turn_[1] - speed * turn_[2]),
                    square(speed * steering.sigma_per_m) + square(kYawRateFloor_rad_per_s), &turn_,
                    &turn_covariance_);
  }
  if (!is_blind) {
    const double difference_variance =
        std::max(1.0, kDifferenceCorrelation_s / motion.dt_s) * 2.0 * square(motion.resolution_m) / 12.0;
    kalmanUpdate<3>(Eigen::RowVector3d(1.0, 0.0, 0.0), (right - left) / options_.track_width_m - turn_[0],
                    difference_variance / square(options_.track_width_m), &turn_, &turn_covariance_);
  }
}

void WheelOdometry::forgetSpeeds() {
  along_[1] = 0.0;
  turn_[1] = 0.0;
  along_covariance_(0, 1) = along_covariance_(1, 0) = 0.0;
  along_covariance_(1, 1) = 1.0;  // the vehicle may start at any moment
  turn_covariance_.row(1).setZero();
  turn_covariance_.col(1).setZero();
  turn_covariance_(1, 1) = 0.1;
}

OdometryEstimate WheelOdometry::estimate(Timestamp stamp, double distance_m, double turn_rad) {
  // First-order propagation of the errors of the arc.
  const double heading = yaw_rad_ + 0.5 * turn_rad;
  Eigen::Matrix3d propagation = Eigen::Matrix3d::Identity();
  propagation(0, 2) = -distance_m * std::sin(heading);
  propagation(1, 2) = distance_m * std::cos(heading);
  const Eigen::Vector3d along(std::cos(heading), std::sin(heading), 0.0);
  const double slip_factor = counts_.slipping ? 10.0 : 1.0;
  // The error of a wrong radius grows linearly with the distance; it is modelled as a random walk with steps
  // of a metre.
  const double distance_variance = square(slip_factor * options_.distance_error_ratio) * std::abs(distance_m);
  const double yaw_variance = square(slip_factor * options_.yaw_error_rad_per_m) * std::abs(distance_m);
  pose_covariance_ = propagation * pose_covariance_ * propagation.transpose() +
                     distance_variance * along * along.transpose();
  pose_covariance_(2, 2) += yaw_variance;
  odom_from_vehicle_ = odom_from_vehicle_ * arcMotion(distance_m, turn_rad);
  yaw_rad_ += turn_rad;

  OdometryEstimate result;
  result.odometry.stamp = stamp;
  result.odometry.odom_from_vehicle = odom_from_vehicle_;
  result.odometry.forward_speed_m_per_s = along_[1];
  result.odometry.yaw_rate_rad_per_s = turn_[1];
  result.pose_covariance = pose_covariance_;
  result.pose_covariance(0, 0) += along_covariance_(0, 0);
  result.pose_covariance(1, 1) += along_covariance_(0, 0);
  result.pose_covariance(2, 2) += turn_covariance_(0, 0);
  result.speed_variance = along_covariance_(1, 1);
  result.yaw_rate_variance = turn_covariance_(1, 1);
  return result;
}

std::optional<OdometryEstimate> WheelOdometry::add(const WheelMeasurement& wheels) {
  const Timestamp stamp = stampOf(wheels);
  if (last_ && stamp <= stampOf(*last_)) {
    ++counts_.out_of_order;
    return std::nullopt;
  }
  ++counts_.measurements;
  if (!last_) {
    last_ = wheels;
    last_motion_ = stamp;
    return estimate(stamp, 0.0, 0.0);
  }
  const Steering steering = steeringOf(wheels);
  const double curvature_per_m = steering.is_known ? steering.curvature_per_m + turn_[2]
                                 : std::abs(along_[1]) > kMinSpeedOfCurvature_m_per_s ? turn_[1] / along_[1]
                                                                                      : 0.0;
  const WheelMotion motion = wheelMotion(*last_, wheels, curvature_per_m, options_);
  last_ = wheels;
  counts_.gaps += motion.dt_s > WheelMotion::kMaxGap_s ? 1 : 0;
  counts_.resets += motion.is_reset ? 1 : 0;
  if (motion.is_reset && motion.dt_s > WheelMotion::kMaxBridgedGap_s) {
    forgetSpeeds();
    window_.clear();
    last_motion_ = stamp;
    addGap(motion.dt_s);
    return estimate(stamp, 0.0, 0.0);
  }
  if (motion.is_reset) {  // the distance in between follows from the speed
    const double along_m = along_[0] + along_[1] * motion.dt_s;
    const double half_apart_m = 0.5 * options_.track_width_m * (turn_[0] + turn_[1] * motion.dt_s);
    left_m_ = along_m - half_apart_m + left_excess_m_;
    right_m_ = along_m + half_apart_m + right_excess_m_;
    window_.clear();
  }
  addMotion(motion);
  if (motion.is_moving || motion.is_reset) {
    last_motion_ = stamp;
  }
  counts_.standing = toSeconds(stamp - last_motion_) >= kStandstill_s;
  if (counts_.standing) {
    forgetSpeeds();  // the wheels stand at an unknown position within their ticks
    window_.clear();
    return estimate(stamp, 0.0, 0.0);
  }
  const double distance_before_m = along_[0];
  const double yaw_before_rad = turn_[0];
  predict(motion.dt_s, steering);
  checkSlip({stamp, left_m_, right_m_, front_left_m_, front_right_m_, steered_yaw_rad_, along_[1]},
            motion.has_front_wheels, steering.is_known);
  correct(motion, steering);
  if (motion.is_interpolated) {
    addGap(motion.dt_s);
  }
  return estimate(stamp, along_[0] - distance_before_m, turn_[0] - yaw_before_rad);
}

}  // namespace vcharge
