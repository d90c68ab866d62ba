#pragma once

#include <functional>

#include "vcharge_core/base/timestamp.h"

namespace vcharge {

/// Maps the kernel's CLOCK_MONOTONIC to the drive's clock (ROS time). The offset comes from the tightest of
/// several readings of both clocks. It follows slow changes (NTP slews the system clock) with at most
/// kMaxSlew; larger changes are counted as steps and applied at once. Not thread safe.
class ClockMap {
 public:
  using Clock = std::function<Timestamp()>;
  static constexpr double kMaxSlew = 1e-3;  ///< seconds per second, twice NTP's limit
  static constexpr double kStep_s = 0.01;

  /// Reads both clocks. An empty `monotonic` means the kernel's clock.
  explicit ClockMap(Clock drive_clock, Clock monotonic = Clock());

  /// Reads both clocks again; call it about once per second.
  void update();
  Timestamp toDriveTime(Timestamp monotonic) const { return monotonic + offset_; }
  uint64_t numSteps() const { return num_steps_; }

 private:
  Duration measure();

  Clock drive_clock_, monotonic_;
  Timestamp last_update_;  // on the monotonic clock
  Duration offset_{0};
  uint64_t num_steps_ = 0;
};

/// The kernel's CLOCK_MONOTONIC.
Timestamp monotonicNow();
/// The system clock, which equals ROS time unless a clock is simulated.
Timestamp systemNow();

}  // namespace vcharge
