#pragma once

#include <functional>

#include "vcharge_core/base/timestamp.h"

namespace vcharge {

/// Maps the kernel's CLOCK_MONOTONIC to the drive's clock (ROS time). The offset is that of the tightest of
/// several readings of both clocks. It follows slow changes (NTP slews the clock of the day) at no more than
/// kMaxSlew; a larger one is a step of the clock, taken at once and counted. Not thread safe.
class ClockMap {
 public:
  using Clock = std::function<Timestamp()>;
  static constexpr double kMaxSlew = 1e-3;  ///< seconds per second; NTP keeps to half of it
  static constexpr double kStep_s = 0.01;

  /// Reads both clocks. `monotonic` may be empty: the kernel's.
  explicit ClockMap(Clock drive_clock, Clock monotonic = Clock());

  /// Reads both clocks again; to be called every second or so.
  void update();
  Timestamp toDriveTime(Timestamp monotonic) const { return monotonic + offset_; }
  uint64_t numSteps() const { return num_steps_; }

 private:
  Duration measure();

  Clock drive_clock_, monotonic_;
  Timestamp last_update_;  // monotonic
  Duration offset_{0};
  uint64_t num_steps_ = 0;
};

/// The kernel's CLOCK_MONOTONIC.
Timestamp monotonicNow();
/// The clock of the day, which is ROS time where no clock is simulated.
Timestamp systemNow();

}  // namespace vcharge
