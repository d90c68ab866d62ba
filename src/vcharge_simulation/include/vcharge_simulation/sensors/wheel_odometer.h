#pragma once

#include <cstdint>
#include <vector>

#include "vcharge_core/motion/vehicle_odometry.h"
#include "vcharge_simulation/faults/fault_options.h"
#include "vcharge_simulation/vehicle/vehicle_motion.h"

namespace vcharge {

/// Errors and filter of a wheel odometer.
struct WheelOdometerOptions {
  double metres_per_tick = 0.01;
  double scale_error = 0.005;        ///< counted distance over true distance, minus 1
  double left_right_error = 0.0003;  ///< the right wheel counts this share more than the left
  double smoothing_s = 0.25;         ///< half width of the filter that tracks the counters

  template <class Visitor>
  void visitFields(Visitor&& visit) {
    visit("metres_per_tick", metres_per_tick);
    visit("scale_error", scale_error);
    visit("left_right_error", left_right_error);
    visit("smoothing_s", smoothing_s);
  }
  void validate() const;  ///< throws std::invalid_argument naming the field
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
