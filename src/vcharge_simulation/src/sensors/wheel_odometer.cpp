#include "vcharge_simulation/sensors/wheel_odometer.h"

#include <algorithm>
#include <cmath>

#include "vcharge_core/base/error.h"
#include "vcharge_simulation/rendering/noise.h"
#include "vcharge_wheel_odometry/wheel_odometry.h"

namespace vcharge {

namespace {

using Wheel = WheelSlipFault::Wheel;

constexpr double kFrameRate_hz = 12.5;

// Wheel rotation relative to the distance rolled on the road.
double turnFactor(const FaultOptions& faults, Wheel wheel, Duration since_start) {
  double factor = 1.0;
  if (faults.odometry_scale.isActive() && faults.odometry_scale.actsAt(since_start)) {
    factor *= faults.odometry_scale.factor;
  }
  if (faults.wheel_slip.isActive() && faults.wheel_slip.wheel == wheel &&
      faults.wheel_slip.actsAt(since_start)) {
    factor *= 1.0 + faults.wheel_slip.ratio;
  }
  return factor;
}

// Without counters an odometer assumes constant growth during the gap.
void bridge(const MissingTicksFault& fault, std::vector<int64_t>* counter) {
  const auto indexAt = [&](double time_s) {
    const double index = std::ceil(time_s * VehicleMotion::kStepsPerSecond) + VehicleMotion::marginSteps();
    return static_cast<size_t>(std::min(index, static_cast<double>(counter->size() - 1)));
  };
  const size_t first = indexAt(fault.start_s) - 1;
  const size_t last = indexAt(fault.end_s);
  const int64_t start = (*counter)[first];
  const auto growth = static_cast<double>((*counter)[last] - start);
  for (size_t i = first + 1; i < last; ++i) {
    const double fraction = static_cast<double>(i - first) / static_cast<double>(last - first);
    (*counter)[i] = start + std::llround(fraction * growth);
  }
}

}  // namespace

WheelOdometer::WheelOdometer(const VehicleMotion& motion, const WheelOdometerOptions& options, uint64_t seed,
                             const FaultOptions& faults)
    : options_(options), faults_(faults), motion_(motion) {
  options.validate();
  faults.validate();
  Random random(seed);
  const double left_phase = random.uniform();
  const double right_phase = random.uniform();
  const double left_scale = 1.0 + options.scale_error - 0.5 * options.left_right_error;
  const double right_scale = 1.0 + options.scale_error + 0.5 * options.left_right_error;
  double left_slip_m = 0.0;
  double right_slip_m = 0.0;
  const MotionSample* last = &motion.samples().front();
  int milliseconds = -VehicleMotion::marginSteps();
  for (const MotionSample& sample : motion.samples()) {
    const Duration since_start = std::chrono::milliseconds(milliseconds++);
    left_slip_m += (turnFactor(faults, Wheel::kLeft, since_start) - 1.0) * left_scale *
                   (sample.left_wheel_m - last->left_wheel_m);
    right_slip_m += (turnFactor(faults, Wheel::kRight, since_start) - 1.0) * right_scale *
                    (sample.right_wheel_m - last->right_wheel_m);
    last = &sample;
    left_m_.push_back(sample.left_wheel_m * left_scale + left_slip_m);
    right_m_.push_back(sample.right_wheel_m * right_scale + right_slip_m);
    left_.push_back(static_cast<int64_t>(std::floor(left_m_.back() / options.metres_per_tick + left_phase)));
    right_.push_back(
        static_cast<int64_t>(std::floor(right_m_.back() / options.metres_per_tick + right_phase)));
  }
  if (faults.missing_ticks.isActive()) {
    bridge(faults.missing_ticks, &left_);
    bridge(faults.missing_ticks, &right_);
  }
}

bool WheelOdometer::isReset(int milliseconds) const {
  return faults_.counter_reset.isActive() &&
         std::chrono::milliseconds(milliseconds) >= durationFromSeconds(faults_.counter_reset.time_s);
}

WheelTicks WheelOdometer::ticks(int milliseconds) const {
  const auto index = static_cast<size_t>(milliseconds + VehicleMotion::marginSteps());
  auto start = static_cast<size_t>(VehicleMotion::marginSteps());
  if (isReset(milliseconds)) {
    start += static_cast<size_t>(std::ceil(faults_.counter_reset.time_s * VehicleMotion::kStepsPerSecond));
  }
  WheelTicks ticks;
  ticks.left_ticks = left_.at(index) - left_.at(start);
  ticks.right_ticks = right_.at(index) - right_.at(start);
  ticks.metres_per_tick = options_.metres_per_tick;
  ticks.steering_angle_rad = steeringAngle(milliseconds);
  return ticks;
}

double WheelOdometer::steeringAngle(int milliseconds) const {
  const int lag = static_cast<int>(std::lround(1000.0 * options_.steering_lag_s));
  const double steering_rad =
      std::atan(motion_.options().wheelbase_m * motion_.at(milliseconds - lag).curvature_per_m);
  const double step_rad = options_.steering_resolution_deg * M_PI / 180.0;
  return step_rad > 0.0 ? step_rad * std::round(steering_rad / step_rad) : steering_rad;
}

WheelSpeeds WheelOdometer::speeds(int milliseconds) const {
  const auto index = static_cast<size_t>(milliseconds + VehicleMotion::marginSteps());
  const auto speedOf = [&](const std::vector<double>& distance_m) {
    return 0.5 * VehicleMotion::kStepsPerSecond * (distance_m.at(index + 1) - distance_m.at(index - 1));
  };
  const auto quantized = [&](double speed_m_per_s) {
    return options_.speed_step_m_per_s * std::round(speed_m_per_s / options_.speed_step_m_per_s);
  };
  const double left = speedOf(left_m_);
  const double right = speedOf(right_m_);
  WheelSpeeds speeds;
  speeds.rear_left_m_per_s = quantized(left);
  speeds.rear_right_m_per_s = quantized(right);
  if (options_.sensor == WheelSensor::kSpeeds) {
    const VehicleMotionOptions& vehicle = motion_.options();
    const auto frontOf = [&](double rear, double side) {
      const double curvature = motion_.at(milliseconds).curvature_per_m;
      const double across = 1.0 - 0.5 * side * vehicle.track_width_m * curvature;
      return quantized(rear * std::hypot(1.0, vehicle.wheelbase_m * curvature / across));
    };
    speeds.front_left_m_per_s = frontOf(left, 1.0);
    speeds.front_right_m_per_s = frontOf(right, -1.0);
  }
  speeds.steering_angle_rad = steeringAngle(milliseconds);
  return speeds;
}

std::vector<Received<VehicleOdometry>> causalOdometry(const std::vector<Received<WheelMeasurement>>& wheels,
                                                      const std::vector<Timestamp>& triggers, Timestamp start,
                                                      std::optional<Timestamp> reset,
                                                      const VehicleMotionOptions& vehicle) {
  WheelOdometryOptions options;
  options.track_width_m = vehicle.track_width_m;
  options.wheelbase_m = vehicle.wheelbase_m;
  WheelOdometry odometry(options);
  OdometryStream stream = OdometryStream::forFrameRate(kFrameRate_hz);
  std::vector<Received<VehicleOdometry>> published;
  std::optional<RigidTransform> first_from_odom;  // the recording begins at the identity
  const auto publish = [&](const std::vector<OdometryEstimate>& estimates, Timestamp now) {
    for (const OdometryEstimate& estimate : estimates) {
      VehicleOdometry message = estimate.odometry;
      if (message.stamp < start) {
        continue;
      }
      first_from_odom = first_from_odom.value_or(message.odom_from_vehicle.inverse());
      message.odom_from_vehicle = *first_from_odom * message.odom_from_vehicle;
      published.push_back({message, now});
    }
  };
  size_t trigger = 0;
  const auto triggerUntil = [&](Timestamp now) {
    for (; trigger < triggers.size() && triggers[trigger] < now; ++trigger) {
      publish(stream.trigger(triggers[trigger]), triggers[trigger]);
    }
  };
  for (const auto& [message, received] : wheels) {
    triggerUntil(received);
    if (reset && stampOf(message) >= *reset) {
      publish(stream.flush(), received);
      odometry = WheelOdometry(options);
      first_from_odom = RigidTransform();
      reset.reset();
    }
    if (const std::optional<OdometryEstimate> estimate = odometry.add(message)) {
      publish(stream.add(*estimate), received);
    }
  }
  if (!wheels.empty()) {
    triggerUntil(wheels.back().received);
    publish(stream.flush(), wheels.back().received);
  }
  return published;
}

}  // namespace vcharge
