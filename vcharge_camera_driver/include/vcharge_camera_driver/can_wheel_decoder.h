#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "vcharge_core/base/options.h"
#include "vcharge_core/motion/vehicle_odometry.h"

namespace vcharge {

enum class ByteOrder { kLittle, kBig };

template <>
inline std::vector<std::string> enumNames<ByteOrder>() {
  return {"little", "big"};
}

/// A classic CAN frame.
struct CanFrame {
  uint32_t id = 0;  ///< 11 or 29 bits
  bool is_extended = false;
  uint8_t size = 0;  ///< 0 to 8
  std::array<uint8_t, 8> data{};
};

/// Position and scaling of a number in a message, as in DBC files: the start bit of a little endian signal is
/// its lowest bit, that of a big endian (Motorola) signal its highest; bits are counted from the lowest of
/// byte 0. value = raw * scale + offset.
struct CanSignal {
  int id = -1;  ///< of the message; negative: the car does not send it; above 0x7ff: an extended one
  int start_bit = 0;
  int length = 0;  ///< bits
  ByteOrder endianness = ByteOrder::kLittle;
  bool is_signed = false;
  double scale = 1.0;
  double offset = 0.0;

  template <class Visitor>
  void visitFields(Visitor&& visit) {
    visit("id", id);
    visit("start_bit", start_bit);
    visit("length", length);
    visit("endianness", endianness);
    visit("signed", is_signed);
    visit("scale", scale);
    visit("offset", offset);
  }
  void validate() const;  ///< throws std::invalid_argument naming the field

  bool isUsed() const { return id >= 0; }
  bool isIn(const CanFrame& frame) const;
  /// The raw bits of the signal; empty if the frame is too short. Ignores the frame's id.
  std::optional<uint64_t> rawBits(const CanFrame& frame) const;
  /// The value with sign, scale and offset.
  std::optional<double> value(const CanFrame& frame) const;
};

/// The car's messages: counters of both rear wheels, or their speeds; the steering angle if it is sent.
struct CanWheelOptions {
  CanSignal left_ticks, right_ticks;                  ///< counters that wrap at their length
  CanSignal left_speed_m_per_s, right_speed_m_per_s;  ///< instead of counters
  CanSignal backwards;  ///< not 0: the car rolls backwards, of which counters or speeds tell nothing
  CanSignal
      steering_angle_rad;  ///< of the virtual front wheel in the middle: the scale includes the steering gear
  double metres_per_tick = 0.01;
  double max_speed_m_per_s = 60.0;  ///< a counter that goes faster was reset

  template <class Visitor>
  void visitFields(Visitor&& visit) {
    visit("left_ticks", left_ticks);
    visit("right_ticks", right_ticks);
    visit("left_speed_m_per_s", left_speed_m_per_s);
    visit("right_speed_m_per_s", right_speed_m_per_s);
    visit("backwards", backwards);
    visit("steering_angle_rad", steering_angle_rad);
    visit("metres_per_tick", metres_per_tick);
    visit("max_speed_m_per_s", max_speed_m_per_s);
  }
  void validate() const;  ///< throws std::invalid_argument naming the field

  bool hasTicks() const { return left_ticks.isUsed(); }
};

struct CanWheelCounts {
  uint64_t frames = 0;
  uint64_t too_short = 0;  ///< messages that end before one of their signals
  uint64_t wraps = 0;
  uint64_t resets = 0;  ///< counters that jumped, or were silent so long that they may have wrapped
};

/// Converts a car's messages to WheelTicks with unwrapped, continuous counters. Speeds are integrated to
/// ticks of kSpeedTick_m. Not thread safe.
class CanWheelDecoder {
 public:
  static constexpr double kSpeedTick_m = 1e-4;

  explicit CanWheelDecoder(const CanWheelOptions& options);
  /// Returns the ticks completed by this frame, at `stamp`: those of the message with both counters, or of
  /// the later message if each wheel has its own. Empty for other frames.
  std::optional<WheelTicks> add(const CanFrame& frame, Timestamp stamp);
  const CanWheelCounts& counts() const { return counts_; }

 private:
  struct Wheel {
    const CanSignal* signal = nullptr;
    bool is_fresh = false;
    std::optional<uint64_t> raw;
    Timestamp stamp;
    double speed_m_per_s = 0.0;
    double speed_error_m_per_s = 0.0;  // upper bound
    double remainder_m = 0.0;
    int64_t ticks = 0;
  };
  bool update(const CanFrame& frame, Timestamp stamp, Wheel* wheel);
  void count(uint64_t raw, Timestamp stamp, Wheel* wheel);
  void integrate(double speed_m_per_s, Timestamp stamp, Wheel* wheel);

  const CanWheelOptions options_;
  const double metres_per_tick_;
  Wheel left_, right_;
  bool backwards_ = false;
  double steering_angle_rad_ = 0.0;
  CanWheelCounts counts_;
};

}  // namespace vcharge
