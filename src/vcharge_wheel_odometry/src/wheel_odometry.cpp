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
    1.0;                                    // rad/s^2 per root of a second, beyond what the steering explains
constexpr double kMaxSpeed_m_per_s = 60.0;  // a counter that changes faster was reset
constexpr double kYawRateFloor_rad_per_s = 1e-3;
constexpr double kSlipWindow_s = 0.5;   // period in which wheels and steering are compared
constexpr double kSlipFraction = 0.25;  // fraction of the turn: steering angles are less exact in tight turns
constexpr double kStandstill_s = 0.3;   // time without a tick

double square(double value) {
  return value * value;
}

/// Pose after an arc from the origin along x.
RigidTransform arc(double distance_m, double turn_rad) {
  const double half = 0.5 * turn_rad;
  const double chord =
      std::abs(half) < 1e-6 ? distance_m * (1.0 - half * half / 6.0) : distance_m * std::sin(half) / half;
  return RigidTransform::planar(chord * std::cos(half), chord * std::sin(half), turn_rad);
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

}  // namespace

WheelOdometry::WheelOdometry(const WheelOdometryOptions& options) : options_(options) {
  options.validate();
  along_covariance_ = Eigen::Vector2d(0.0, 1.0).asDiagonal();
  turn_covariance_ = Eigen::Vector3d(0.0, 0.1, square(kZeroSigma_per_m)).asDiagonal();
}

std::pair<double, double> WheelOdometry::steeredCurvature(const WheelTicks& ticks) {
  const double told = std::tan(ticks.steering_angle_rad) / options_.wheelbase_m;
  const auto lag = durationFromSeconds(options_.steering_lag_s);
  steering_.emplace_back(ticks.stamp, told);
  while (steering_.size() > 1 && steering_[1].first <= ticks.stamp - lag) {
    steering_.pop_front();
  }
  // The steering goes on turning as during the last lag. A lag may be half as long or half as long again.
  const double since_s = toSeconds(ticks.stamp - steering_.front().first);
  const double change =
      since_s > 0.0 ? (told - steering_.front().second) * options_.steering_lag_s / since_s : 0.0;
  return {told + change, std::hypot(options_.steering_noise_per_m, 0.5 * change)};
}

void WheelOdometry::predict(double dt_s, double steered_curvature) {
  steered_yaw_rad_ += along_[1] * (steered_curvature + turn_[2]) * dt_s;
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
      square(options_.use_steering ? kSteeredYawAcceleration : options_.max_yaw_acceleration_rad_per_s2),
      &turn_covariance_);
  turn_covariance_(0, 0) += square(kYawNoise_rad) * dt_s;
  turn_covariance_(2, 2) += square(kZeroNoise_per_m) * dt_s;
}

void WheelOdometry::checkSlip(const Sample& sample) {
  window_.push_back(sample);
  while (toSeconds(sample.stamp - window_.front().stamp) > kSlipWindow_s) {
    window_.pop_front();
  }
  const Sample& first = window_.front();
  const double left_m = sample.left_m - first.left_m;
  const double right_m = sample.right_m - first.right_m;
  const double steered_rad = sample.steered_yaw_rad - first.steered_yaw_rad;
  const double wheels_rad = (right_m - left_m) / options_.track_width_m;
  const bool slips = std::abs(wheels_rad - steered_rad) >
                     std::max(options_.slip_yaw_rad, kSlipFraction * std::abs(steered_rad));
  if (slips && !counts_.slipping) {
    ++counts_.slips;
    // The slipping wheel changed its speed more than a car can.
    const double before_m = first.speed_m_per_s * toSeconds(sample.stamp - first.stamp);
    const double half_turn_m = 0.5 * steered_rad * options_.track_width_m;
    left_slips_ = std::abs(left_m - (before_m - half_turn_m)) > std::abs(right_m - (before_m + half_turn_m));
  }
  counts_.slipping = slips;
}

void WheelOdometry::correct(double dt_s, double tick_m, double steered_curvature, double steered_sigma) {
  const double left_m = left_m_;
  const double right_m = right_m_;
  if (counts_.slipping) {
    // The position of the slipping wheel follows from the other wheel and the steering.
    const double apart_m = options_.track_width_m * turn_[0];
    (left_slips_ ? left_excess_m_ : right_excess_m_) = left_slips_
                                                           ? left_m - (right_m - right_excess_m_ - apart_m)
                                                           : right_m - (left_m - left_excess_m_ + apart_m);
  }
  const double left = left_m - left_excess_m_;
  const double right = right_m - right_excess_m_;
  const double count_variance = kCountsPerIndependentOne * square(tick_m) / 12.0;
  kalmanUpdate<2>(Eigen::RowVector2d(1.0, 0.0), 0.5 * (left + right) - along_[0], 0.5 * count_variance,
                  &along_, &along_covariance_);
  if (options_.use_steering) {
    const double speed = along_[1];
    kalmanUpdate<3>(
        Eigen::RowVector3d(0.0, 1.0, -speed), speed * steered_curvature - (turn_[1] - speed * turn_[2]),
        square(speed * steered_sigma) + square(kYawRateFloor_rad_per_s), &turn_, &turn_covariance_);
  }
  if (!counts_.slipping) {
    const double difference_variance =
        std::max(1.0, kDifferenceCorrelation_s / dt_s) * 2.0 * square(tick_m) / 12.0;
    kalmanUpdate<3>(Eigen::RowVector3d(1.0, 0.0, 0.0), (right - left) / options_.track_width_m - turn_[0],
                    difference_variance / square(options_.track_width_m), &turn_, &turn_covariance_);
  }
}

// If no ticks come for a while, the wheels stand at an unknown position within their ticks.
void WheelOdometry::stand() {
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
  odom_from_vehicle_ = odom_from_vehicle_ * arc(distance_m, turn_rad);
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

std::optional<OdometryEstimate> WheelOdometry::add(const WheelTicks& ticks) {
  if (last_ && ticks.stamp <= last_->stamp) {
    ++counts_.out_of_order;
    return std::nullopt;
  }
  ++counts_.ticks;
  if (!last_) {
    last_ = ticks;
    last_motion_ = ticks.stamp;
    return estimate(ticks.stamp, 0.0, 0.0);
  }
  const double dt_s = toSeconds(ticks.stamp - last_->stamp);
  counts_.gaps += dt_s > kMaxGap_s ? 1 : 0;
  const int64_t left_change = ticks.left_ticks - last_->left_ticks;
  const int64_t right_change = ticks.right_ticks - last_->right_ticks;
  const double tick_m = ticks.metres_per_tick;
  const bool jumped =
      std::max(std::abs(static_cast<double>(left_change)), std::abs(static_cast<double>(right_change))) *
          tick_m >
      kMaxSpeed_m_per_s * dt_s + 4.0 * tick_m;
  last_ = ticks;
  if (jumped) {  // the counters were reset: the distance in between follows from the speed
    ++counts_.resets;
    left_m_ = along_[0] + along_[1] * dt_s - 0.5 * options_.track_width_m * (turn_[0] + turn_[1] * dt_s) +
              left_excess_m_;
    right_m_ = along_[0] + along_[1] * dt_s + 0.5 * options_.track_width_m * (turn_[0] + turn_[1] * dt_s) +
               right_excess_m_;
    window_.clear();
    last_motion_ = ticks.stamp;
  }
  left_m_ += jumped ? 0.0 : static_cast<double>(left_change) * tick_m;
  right_m_ += jumped ? 0.0 : static_cast<double>(right_change) * tick_m;
  if (left_change != 0 || right_change != 0) {
    last_motion_ = ticks.stamp;
  }
  counts_.standing = toSeconds(ticks.stamp - last_motion_) >= kStandstill_s;
  if (counts_.standing) {
    stand();
    window_.clear();
    return estimate(ticks.stamp, 0.0, 0.0);
  }
  const auto [steered_curvature, steered_sigma] = steeredCurvature(ticks);
  const double distance_before_m = along_[0];
  const double yaw_before_rad = turn_[0];
  predict(dt_s, steered_curvature);
  if (options_.use_steering) {
    checkSlip({ticks.stamp, left_m_, right_m_, steered_yaw_rad_, along_[1]});
  }
  correct(dt_s, tick_m, steered_curvature, steered_sigma);
  return estimate(ticks.stamp, along_[0] - distance_before_m, turn_[0] - yaw_before_rad);
}

OdometryStream::OdometryStream(double hold_s, double max_extrapolation_s)
    : hold_(durationFromSeconds(hold_s)), max_extrapolation_(durationFromSeconds(max_extrapolation_s)) {}

OdometryStream OdometryStream::forFrameRate(double frame_rate_hz) {
  // An estimate waits for the next trigger, which may be late by half a period.
  return OdometryStream(1.5 / frame_rate_hz, 0.1);
}

std::vector<OdometryEstimate> OdometryStream::flush() {
  std::vector<OdometryEstimate> ready;
  if (!history_.empty()) {
    release(history_.back().odometry.stamp + Duration(1), &ready);
  }
  history_.clear();
  extrapolated_.reset();
  return ready;
}

void OdometryStream::release(Timestamp before, std::vector<OdometryEstimate>* ready) {
  for (const OdometryEstimate& each : history_) {
    if (each.odometry.stamp < before && (!published_ || *published_ < each.odometry.stamp)) {
      ready->push_back(each);
      published_ = each.odometry.stamp;
    }
  }
}

std::vector<OdometryEstimate> OdometryStream::add(const OdometryEstimate& estimate) {
  std::vector<OdometryEstimate> ready;
  if (!history_.empty() && estimate.odometry.stamp <= history_.back().odometry.stamp) {
    return ready;
  }
  history_.push_back(estimate);
  if (extrapolated_ && *extrapolated_ <= estimate.odometry.stamp) {
    const std::optional<OdometryEstimate> corrected = at(*extrapolated_);
    // After a gap in the ticks a correction comes too late to be sorted by those who read it.
    if (corrected && estimate.odometry.stamp - *extrapolated_ <= hold_) {
      ready.push_back(*corrected);
    }
    extrapolated_.reset();
  }
  release(estimate.odometry.stamp - hold_, &ready);
  while (toSeconds(estimate.odometry.stamp - history_.front().odometry.stamp) > 1.0) {
    history_.pop_front();
  }
  return ready;
}

std::optional<OdometryEstimate> OdometryStream::at(Timestamp stamp) const {
  const auto after = std::find_if(history_.begin(), history_.end(),
                                  [&](const OdometryEstimate& each) { return stamp <= each.odometry.stamp; });
  if (after != history_.end() && after->odometry.stamp == stamp) {
    return *after;
  }
  if (after == history_.begin()) {
    return std::nullopt;
  }
  OdometryEstimate result = *(after - 1);
  const VehicleOdometry& from = (after - 1)->odometry;
  const double since_s = toSeconds(stamp - from.stamp);
  result.odometry.stamp = stamp;
  if (after == history_.end()) {
    if (stamp - from.stamp > max_extrapolation_) {
      return std::nullopt;
    }
    result.odometry.odom_from_vehicle =
        from.odom_from_vehicle * arc(from.forward_speed_m_per_s * since_s, from.yaw_rate_rad_per_s * since_s);
    return result;
  }
  const VehicleOdometry& to = after->odometry;
  const double fraction = since_s / toSeconds(to.stamp - from.stamp);
  result.odometry.odom_from_vehicle = interpolate(from.odom_from_vehicle, to.odom_from_vehicle, fraction);
  result.odometry.forward_speed_m_per_s += fraction * (to.forward_speed_m_per_s - from.forward_speed_m_per_s);
  result.odometry.yaw_rate_rad_per_s += fraction * (to.yaw_rate_rad_per_s - from.yaw_rate_rad_per_s);
  return result;
}

std::vector<OdometryEstimate> OdometryStream::trigger(Timestamp stamp) {
  std::vector<OdometryEstimate> ready;
  release(stamp, &ready);
  if (!published_ || *published_ < stamp) {
    if (const std::optional<OdometryEstimate> estimate = at(stamp)) {
      ready.push_back(*estimate);
      published_ = stamp;
      if (history_.back().odometry.stamp < stamp) {
        extrapolated_ = stamp;
      }
    }
  }
  return ready;
}

}  // namespace vcharge
