#pragma once

#include "vcharge_core/base/options.h"
#include "vcharge_core/motion/vehicle_odometry.h"

namespace vcharge {

struct WheelOdometryOptions {
  VCHARGE_BEGIN_OPTIONS(WheelOdometryOptions);
  VCHARGE_OPTION(double, track_width_m, 1.52, positive(), "Distance between the rear wheels.");
  VCHARGE_OPTION(double, wheelbase_m, 2.58, positive(), "Distance between the axles.");
  VCHARGE_OPTION(double, left_scale, 1.0, positive(), "True distance by that of the left rear wheel's data.");
  VCHARGE_OPTION(double, right_scale, 1.0, positive(), "The same of the right rear wheel.");
  VCHARGE_OPTION(bool, use_steering, true, anyValue(), "Whether the car measures the steering angle.");
  VCHARGE_OPTION(double, steering_lag_s, 0.05, between(0.0, 0.5), "Age of the steering angle at its stamp.");
  VCHARGE_OPTION(double, max_acceleration_m_per_s2, 1.5, positive(), "Noise of the speed in a second.");
  VCHARGE_OPTION(double, max_yaw_acceleration_rad_per_s2, 0.4, positive(), "The same of the yaw rate.");
  VCHARGE_OPTION(double, steering_noise_per_m, 0.002, positive(), "Sigma of the steered curvature.");
  VCHARGE_OPTION(double, slip_yaw_rad, 0.04, positive(), "Larger disagreement with the steering is a slip.");
  VCHARGE_OPTION(double, distance_error_ratio, 0.005, positive(), "Relative error of the wheel radius.");
  VCHARGE_OPTION(double, yaw_error_rad_per_m, 0.0005, positive(), "Heading error of unequal wheels.");
  VCHARGE_END_OPTIONS();
};

/// Motion of the wheels between two successive measurements: distances along the car, at its left and right
/// sides.
struct WheelMotion {
  static constexpr double kMaxGap_s = 0.5;          ///< speeds that are farther apart have a gap between them
  static constexpr double kMaxBridgedGap_s = 10.0;  ///< nothing is known of the motion in a longer gap

  double dt_s = 0.0;
  double left_m = 0.0, right_m = 0.0;              ///< of the rear wheels
  double front_left_m = 0.0, front_right_m = 0.0;  ///< valid if has_front_wheels
  bool has_front_wheels = false;
  double resolution_m = 0.0;  ///< distances measured from any beginning are exact within this
  bool is_moving = false;
  bool is_reset = false;  ///< counters jumped, or speeds have a long gap: the distances are unknown and 0
  bool is_interpolated = false;  ///< from speeds before and after a gap
};

/// Speeds are integrated by the trapezoidal rule. A front wheel rolls along the direction to which it is
/// steered, so its speed times the cosine of this angle is that of the rear wheel on its side;
/// `curvature_per_m` of the path tells the angle. std::logic_error for measurements of two kinds, or without
/// finite rear speeds.
WheelMotion wheelMotion(const WheelMeasurement& before, const WheelMeasurement& now, double curvature_per_m,
                        const WheelOdometryOptions& options);

}  // namespace vcharge
