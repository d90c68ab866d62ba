#include "vcharge_simulation/sensors/wheel_odometer.h"

#include <algorithm>
#include <cmath>

#include "vcharge_core/base/error.h"
#include "vcharge_simulation/rendering/noise.h"

namespace vcharge {

namespace {

using Wheel = WheelSlipFault::Wheel;

// Half width of the filter window: long enough to average the quantization of the counters.
constexpr double kSmoothing_s = 0.25;
static_assert(kSmoothing_s <= VehicleMotion::kMargin_s, "the window must fit the margin of the motion");

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
    left_.push_back(static_cast<int64_t>(
        std::floor((sample.left_wheel_m * left_scale + left_slip_m) / options.metres_per_tick + left_phase)));
    right_.push_back(static_cast<int64_t>(std::floor(
        (sample.right_wheel_m * right_scale + right_slip_m) / options.metres_per_tick + right_phase)));
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
  ticks.steering_angle_rad =
      std::atan(motion_.options().wheelbase_m * motion_.at(milliseconds).curvature_per_m);
  return ticks;
}

WheelOdometer::WheelState WheelOdometer::smoothed(const std::vector<int64_t>& counter,
                                                  int milliseconds) const {
  // Least-squares parabola over a symmetric window (Savitzky and Golay). Its value and its slope at the
  // centre are weighted sums of the counters with closed-form weights.
  const int half = static_cast<int>(std::lround(kSmoothing_s * VehicleMotion::kStepsPerSecond));
  const int centre = milliseconds + VehicleMotion::marginSteps();
  const double n = 2.0 * half + 1.0;
  const double s2 = half * (half + 1.0) * n / 3.0;                      // sum of i^2
  const double s4 = s2 * (3.0 * half * half + 3.0 * half - 1.0) / 5.0;  // sum of i^4
  const double determinant = n * s4 - s2 * s2;
  // Relative to the centre, so that the sums stay exact on long drives.
  const int64_t reference = counter.at(static_cast<size_t>(centre));
  double value = 0.0;
  double slope = 0.0;
  for (int i = -half; i <= half; ++i) {
    const auto ticks = static_cast<double>(counter.at(static_cast<size_t>(centre + i)) - reference);
    value += (s4 - s2 * i * i) / determinant * ticks;
    slope += i / s2 * ticks;
  }
  return {(static_cast<double>(reference) + value) * options_.metres_per_tick,
          slope * options_.metres_per_tick * VehicleMotion::kStepsPerSecond};
}

std::vector<VehicleOdometry> WheelOdometer::deadReckoning(const std::vector<int>& milliseconds) const {
  std::vector<VehicleOdometry> result;
  const double track_m = motion_.options().track_width_m;
  WheelState last_left{};
  WheelState last_right{};
  RigidTransform odom_from_vehicle;
  for (size_t i = 0; i < milliseconds.size(); ++i) {
    check(i == 0 || milliseconds[i] > milliseconds[i - 1],
          "WheelOdometer::deadReckoning: times must increase");
    const WheelState left = smoothed(left_, milliseconds[i]);
    const WheelState right = smoothed(right_, milliseconds[i]);
    if (i > 0) {
      const double left_m = left.distance_m - last_left.distance_m;
      const double right_m = right.distance_m - last_right.distance_m;
      odom_from_vehicle =
          odom_from_vehicle * arcMotion(0.5 * (left_m + right_m), (right_m - left_m) / track_m);
      if (isReset(milliseconds[i]) && !isReset(milliseconds[i - 1])) {
        odom_from_vehicle = RigidTransform();
      }
    }
    VehicleOdometry odometry;
    odometry.odom_from_vehicle = odom_from_vehicle;
    odometry.forward_speed_m_per_s = 0.5 * (left.speed_m_per_s + right.speed_m_per_s);
    odometry.yaw_rate_rad_per_s = (right.speed_m_per_s - left.speed_m_per_s) / track_m;
    result.push_back(odometry);
    last_left = left;
    last_right = right;
  }
  return result;
}

}  // namespace vcharge
