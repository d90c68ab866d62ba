#pragma once

#include <cstdint>
#include <vector>

#include "vcharge_core/motion/vehicle_odometry.h"
#include "vcharge_simulation/faults/fault_options.h"
#include "vcharge_simulation/vehicle/vehicle_motion.h"

namespace vcharge {

/// Errors of a wheel odometer.
struct WheelOdometerOptions {
  VCHARGE_BEGIN_OPTIONS(WheelOdometerOptions);
  VCHARGE_OPTION(double, metres_per_tick, 0.01, positive(), "Distance per tick of the wheel counters.");
  VCHARGE_OPTION(double, scale_error, 0.005, above(-0.5).below(0.5), "Counted over true distance, minus 1.");
  VCHARGE_OPTION(double, left_right_error, 0.0003, above(-0.5).below(0.5),
                 "Relative excess of the right wheel's count over the left wheel's.");
  VCHARGE_END_OPTIONS();
};

/// Counters of the rear wheels, and dead reckoning from them. Quantization is a bounded error of each
/// counter, so the filter fits a parabola to the counters around each instant (Savitzky and Golay) instead of
/// summing noisy increments; a wrong wheel radius remains as drift.
class WheelOdometer {
 public:
  /// `seed` selects the phase of the counters at the start. Only faults of wheels and counters act here.
  WheelOdometer(const VehicleMotion& motion, const WheelOdometerOptions& options, uint64_t seed,
                const FaultOptions& faults = FaultOptions());

  /// Raw counters at a whole millisecond of the drive; zero at the start and at a reset.
  WheelTicks ticks(int milliseconds) const;
  /// Planar dead reckoning at increasing milliseconds. The first pose, and the first one after a reset, is
  /// the identity. The caller sets the stamps.
  std::vector<VehicleOdometry> deadReckoning(const std::vector<int>& milliseconds) const;

 private:
  struct WheelState {
    double distance_m, speed_m_per_s;
  };
  WheelState smoothed(const std::vector<int64_t>& counter, int milliseconds) const;
  bool isReset(int milliseconds) const;

  WheelOdometerOptions options_;
  FaultOptions faults_;
  const VehicleMotion& motion_;
  std::vector<int64_t> left_, right_;  // one value per millisecond
};

}  // namespace vcharge
