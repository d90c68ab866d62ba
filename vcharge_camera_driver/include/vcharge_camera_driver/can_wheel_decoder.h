#pragma once

#include <cstdint>
#include <optional>

#include "vcharge_camera_driver/can_wheel_options.h"
#include "vcharge_core/motion/vehicle_odometry.h"

namespace vcharge {

struct CanWheelCounts {
  uint64_t frames = 0;
  uint64_t too_short = 0;  ///< messages that end before one of their signals
  uint64_t wraps = 0;
  uint64_t resets = 0;   ///< counters that jumped, or may have wrapped during a long silence
  uint64_t invalid = 0;  ///< speeds beyond max_speed_m_per_s, with which cars mark failures
};

/// Converts a car's messages to WheelTicks with unwrapped, continuous counters, or to WheelSpeeds. Without
/// CanWheelOptions::backwards, speeds and counters without sign count reversing as driving forwards. Not
/// thread safe.
class CanWheelDecoder {
 public:
  static constexpr double kMaxAge_s = 0.2;  ///< older steering angles and front wheels are unknown

  explicit CanWheelDecoder(const CanWheelOptions& options);
  /// Returns the measurement completed by this frame, at `stamp`: after the message with both rear wheels,
  /// or after the later message if each wheel has its own. Empty for other frames.
  std::optional<WheelMeasurement> add(const CanFrame& frame, Timestamp stamp);
  const CanWheelCounts& counts() const { return counts_; }

 private:
  struct Counter {
    const CanSignal* signal = nullptr;
    bool is_fresh = false;
    std::optional<uint64_t> raw;
    Timestamp stamp;
    double speed_m_per_s = 0.0;
    double speed_error_m_per_s = 0.0;  // upper bound
    int64_t ticks = 0;
  };
  struct Value {
    const CanSignal* signal = nullptr;
    std::optional<double> value;
    Timestamp stamp;
    double at(Timestamp now) const;
  };
  void count(const CanFrame& frame, Timestamp stamp, Counter* counter);
  bool read(const CanFrame& frame, Timestamp stamp, Value* value);
  bool readSpeed(const CanFrame& frame, Timestamp stamp, Value* speed);
  std::optional<WheelMeasurement> addTicks(const CanFrame& frame, Timestamp stamp);
  std::optional<WheelMeasurement> addSpeeds(const CanFrame& frame, Timestamp stamp);

  const CanWheelOptions options_;
  Counter left_ticks_, right_ticks_;
  Value left_speed_, right_speed_, front_left_speed_, front_right_speed_;
  Value backwards_, steering_;
  bool rolls_backwards_ = false;
  CanWheelCounts counts_;
};

}  // namespace vcharge
