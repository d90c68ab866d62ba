#include "vcharge_simulation/wheel_odometer.h"

#include <cmath>

#include "vcharge_core/error.h"
#include "vcharge_core/options.h"
#include "vcharge_simulation/noise.h"

namespace vcharge {

void WheelOdometerOptions::validate() const {
  requireField(metres_per_tick > 0.0, "metres_per_tick", "must be positive", metres_per_tick);
  requireField(std::abs(scale_error) < 0.5, "scale_error", "must be in (-0.5, 0.5)", scale_error);
  requireField(std::abs(left_right_error) < 0.5, "left_right_error", "must be in (-0.5, 0.5)",
               left_right_error);
  requireField(smoothing_s > 0.0 && smoothing_s <= VehicleMotion::kMargin_s, "smoothing_s",
               "must be in (0, 0.5]", smoothing_s);
}

WheelOdometer::WheelOdometer(const VehicleMotion& motion, const WheelOdometerOptions& options, uint64_t seed)
    : options_(options), motion_(motion) {
  options.validate();
  Random random(seed);
  const double left_phase = random.uniform();
  const double right_phase = random.uniform();
  const double left_scale = 1.0 + options.scale_error - 0.5 * options.left_right_error;
  const double right_scale = 1.0 + options.scale_error + 0.5 * options.left_right_error;
  for (const MotionSample& sample : motion.samples()) {
    left_.push_back(static_cast<int64_t>(
        std::floor(sample.left_wheel_m * left_scale / options.metres_per_tick + left_phase)));
    right_.push_back(static_cast<int64_t>(
        std::floor(sample.right_wheel_m * right_scale / options.metres_per_tick + right_phase)));
  }
}

WheelTicks WheelOdometer::ticks(int milliseconds) const {
  const auto index = static_cast<size_t>(milliseconds + VehicleMotion::marginSteps());
  const auto start = static_cast<size_t>(VehicleMotion::marginSteps());
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
  // Least-squares parabola over a window that is symmetric about the instant (Savitzky and Golay): its value
  // is a weighted mean of the counters with weights in closed form, and so is its slope.
  const int half = static_cast<int>(std::lround(options_.smoothing_s * VehicleMotion::kStepsPerSecond));
  const int centre = milliseconds + VehicleMotion::marginSteps();
  const double n = 2.0 * half + 1.0;
  const double s2 = half * (half + 1.0) * n / 3.0;                      // sum of i^2
  const double s4 = s2 * (3.0 * half * half + 3.0 * half - 1.0) / 5.0;  // sum of i^4
  const double determinant = n * s4 - s2 * s2;
  // Relative to the centre, so that sums stay exact far into a drive.
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
