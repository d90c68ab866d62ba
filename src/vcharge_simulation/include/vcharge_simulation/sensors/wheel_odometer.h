#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "vcharge_core/motion/vehicle_odometry.h"
#include "vcharge_simulation/faults/fault_options.h"
#include "vcharge_simulation/vehicle/vehicle_motion.h"

namespace vcharge {

/// What the car tells of its wheels: counters of the rear wheels, or speeds of two or four wheels.
enum class WheelSensor { kTicks, kRearSpeeds, kSpeeds };

template <>
inline std::vector<std::string> enumNames<WheelSensor>() {
  return {"ticks", "rear_speeds", "speeds"};
}

/// Resolution, errors and delays of the wheel and steering sensors.
struct WheelOdometerOptions {
  VCHARGE_BEGIN_OPTIONS(WheelOdometerOptions);
  VCHARGE_OPTION(WheelSensor, sensor, WheelSensor::kTicks, anyValue(),
                 "Counters of the rear wheels, or speeds of the rear or of all wheels.");
  VCHARGE_OPTION(double, speed_step_m_per_s, 0.01, positive(), "Resolution of the speeds.");
  VCHARGE_OPTION(double, metres_per_tick, 0.01, positive(), "Distance per tick of the wheel counters.");
  VCHARGE_OPTION(double, scale_error, 0.005, above(-0.5).below(0.5), "Counted over true distance, minus 1.");
  VCHARGE_OPTION(double, left_right_error, 0.0003, above(-0.5).below(0.5),
                 "Relative excess of the right wheel's count over the left wheel's.");
  VCHARGE_OPTION(double, steering_resolution_deg, 0.1, notNegative(), "Step of the steering angle.");
  VCHARGE_OPTION(double, steering_lag_s, 0.05, between(0.0, 0.2), "Age of the steering angle at its stamp.");
  VCHARGE_OPTION(double, latency_s, 0.02, between(0.0, 1.0), "Time from a measurement to its reception.");
  VCHARGE_OPTION(double, latency_jitter_s, 0.005, between(0.0, 1.0),
                 "Largest random addition to the latency.");
  VCHARGE_END_OPTIONS();
};

/// A message and the time at which it is received.
template <class Message>
struct Received {
  Message message;
  Timestamp received;
};

/// Counters or speeds of the wheels with the steering angle, as a car's bus reports them.
class WheelOdometer {
 public:
  /// `seed` selects the phase of the counters at the start and the jitter. Only faults of wheels and counters
  /// act here.
  WheelOdometer(const VehicleMotion& motion, const WheelOdometerOptions& options, uint64_t seed,
                const FaultOptions& faults = FaultOptions());

  /// Counters and steering at a whole millisecond of the drive; the counters are zero at the start and at a
  /// reset. The caller sets the stamp.
  WheelTicks ticks(int milliseconds) const;
  /// Speeds of the wheels' circumferences and steering, with the same errors as the counters. A front wheel
  /// rolls along its steered direction and has the errors of the rear wheel on its side.
  WheelSpeeds speeds(int milliseconds) const;
  bool isReset(int milliseconds) const;
  const VehicleMotion& motion() const { return motion_; }
  const WheelOdometerOptions& options() const { return options_; }

 private:
  double steeringAngle(int milliseconds) const;

  WheelOdometerOptions options_;
  FaultOptions faults_;
  const VehicleMotion& motion_;
  std::vector<int64_t> left_, right_;     // one value per millisecond
  std::vector<double> left_m_, right_m_;  // measured distances, likewise
};

/// The odometry that the camera driver publishes of these measurements, in the order of publication: at an
/// image's stamp only those received by then are known, so that its pose is extrapolated, and corrected under
/// the same stamp once they reach it. `wheels`: of one kind, in order of reception, may begin before the
/// recording, which begins at `start` with the identity. `triggers`: stamps of the images. At `reset` the
/// odometer starts again at the identity.
std::vector<Received<VehicleOdometry>> causalOdometry(const std::vector<Received<WheelMeasurement>>& wheels,
                                                      const std::vector<Timestamp>& triggers, Timestamp start,
                                                      std::optional<Timestamp> reset,
                                                      const VehicleMotionOptions& vehicle);

}  // namespace vcharge
