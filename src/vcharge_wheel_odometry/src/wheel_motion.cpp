#include "vcharge_wheel_odometry/wheel_motion.h"

#include <algorithm>
#include <cmath>

#include "vcharge_core/base/error.h"

namespace vcharge {
namespace {

constexpr double kMaxSpeed_m_per_s = 60.0;  // a counter that changes faster was reset
// Cars compute wheel speeds from pulses: the integral of the speeds jitters by millimetres around the truth.
constexpr double kSpeedResolution_m = 0.005;
constexpr double kStandingSpeed_m_per_s = 1e-3;  // less than the steps in which cars tell speeds

/// Cosine of the angle of a front wheel at the lateral position `left_m` to the car's axis.
double cosineOfFrontWheel(double curvature_per_m, double left_m, double wheelbase_m) {
  const double along = 1.0 - curvature_per_m * left_m;
  return along / std::hypot(along, curvature_per_m * wheelbase_m);
}

WheelMotion motionOf(const WheelTicks& before, const WheelTicks& now, double dt_s, double /*curvature_per_m*/,
                     const WheelOdometryOptions& options) {
  const int64_t left_change = now.left_ticks - before.left_ticks;
  const int64_t right_change = now.right_ticks - before.right_ticks;
  const double tick_m = now.metres_per_tick;
  WheelMotion motion;
  motion.resolution_m = tick_m;
  motion.is_moving = left_change != 0 || right_change != 0;
  motion.is_reset =
      std::max(std::abs(static_cast<double>(left_change)), std::abs(static_cast<double>(right_change))) *
          tick_m >
      kMaxSpeed_m_per_s * dt_s + 4.0 * tick_m;
  if (!motion.is_reset) {
    motion.left_m = static_cast<double>(left_change) * tick_m * options.left_scale;
    motion.right_m = static_cast<double>(right_change) * tick_m * options.right_scale;
  }
  return motion;
}

WheelMotion motionOf(const WheelSpeeds& before, const WheelSpeeds& now, double dt_s, double curvature_per_m,
                     const WheelOdometryOptions& options) {
  check(std::isfinite(now.rear_left_m_per_s) && std::isfinite(now.rear_right_m_per_s),
        "WheelOdometry: the speeds of the rear wheels must be finite");
  const auto distance_m = [dt_s](double speed_before, double speed_now, double factor) {
    return 0.5 * (speed_before + speed_now) * dt_s * factor;
  };
  const double half_track_m = 0.5 * options.track_width_m;
  WheelMotion motion;
  motion.resolution_m = kSpeedResolution_m;
  for (const double speed :
       {now.rear_left_m_per_s, now.rear_right_m_per_s, now.front_left_m_per_s, now.front_right_m_per_s}) {
    motion.is_moving = motion.is_moving || std::abs(speed) > kStandingSpeed_m_per_s;  // false for NaN
  }
  motion.is_reset = dt_s > WheelMotion::kMaxBridgedGap_s;
  if (motion.is_reset) {
    return motion;
  }
  motion.is_interpolated = dt_s > WheelMotion::kMaxGap_s;
  motion.left_m = distance_m(before.rear_left_m_per_s, now.rear_left_m_per_s, options.left_scale);
  motion.right_m = distance_m(before.rear_right_m_per_s, now.rear_right_m_per_s, options.right_scale);
  motion.front_left_m =
      distance_m(before.front_left_m_per_s, now.front_left_m_per_s,
                 options.left_scale * cosineOfFrontWheel(curvature_per_m, half_track_m, options.wheelbase_m));
  motion.front_right_m = distance_m(
      before.front_right_m_per_s, now.front_right_m_per_s,
      options.right_scale * cosineOfFrontWheel(curvature_per_m, -half_track_m, options.wheelbase_m));
  motion.has_front_wheels = std::isfinite(motion.front_left_m) && std::isfinite(motion.front_right_m);
  return motion;
}

WheelMotion motionOf(const WheelTicks&, const WheelSpeeds&, double, double, const WheelOdometryOptions&) {
  throw std::logic_error("WheelOdometry: got wheel speeds after ticks");
}
WheelMotion motionOf(const WheelSpeeds&, const WheelTicks&, double, double, const WheelOdometryOptions&) {
  throw std::logic_error("WheelOdometry: got ticks after wheel speeds");
}

}  // namespace

WheelMotion wheelMotion(const WheelMeasurement& before, const WheelMeasurement& now, double curvature_per_m,
                        const WheelOdometryOptions& options) {
  const double dt_s = toSeconds(stampOf(now) - stampOf(before));
  WheelMotion motion = std::visit(
      [&](const auto& from, const auto& to) { return motionOf(from, to, dt_s, curvature_per_m, options); },
      before, now);
  motion.dt_s = dt_s;
  return motion;
}

}  // namespace vcharge
