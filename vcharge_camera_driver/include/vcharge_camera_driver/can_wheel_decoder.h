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

/// Position and scaling of a number in a message, as in DBC files: little endian signals start at the lowest
/// bit, big endian (Motorola) signals at the highest bit; bits are counted from the lowest of
/// byte 0. value = raw * scale + offset.
struct CanSignal {
  VCHARGE_BEGIN_OPTIONS(CanSignal);
  VCHARGE_OPTION(int, id, -1, anyValue().upTo(0x1fffffff),
                 "Identifier of the message, extended above 0x7ff; negative: the car does not send it.");
  VCHARGE_OPTION(int, start_bit, 0, between(0, 63), "First bit, as in DBC files.");
  VCHARGE_OPTION(int, length, 0, between(0, 64), "Number of bits.");
  VCHARGE_OPTION(ByteOrder, endianness, ByteOrder::kLittle, anyValue(), "Byte order.");
  VCHARGE_OPTION(bool, is_signed, false, anyValue(), "Whether the number is signed (two's complement).");
  VCHARGE_OPTION(double, scale, 1.0, anyValue(), "Factor of the raw number.");
  VCHARGE_OPTION(double, offset, 0.0, anyValue(), "Added to the scaled number.");
  VCHARGE_END_OPTIONS();
  void checkFields() const;

  bool isUsed() const { return id >= 0; }
  bool isIn(const CanFrame& frame) const;
  /// The raw bits of the signal; empty if the frame is too short. Ignores the frame's id.
  std::optional<uint64_t> rawBits(const CanFrame& frame) const;
  /// The value with sign, scale and offset.
  std::optional<double> value(const CanFrame& frame) const;
};

/// The car's messages: counters or speeds of both rear wheels, and optionally the steering angle.
struct CanWheelOptions {
  VCHARGE_BEGIN_OPTIONS(CanWheelOptions);
  VCHARGE_OPTION_GROUP(CanSignal, left_ticks, {},
                       "Counter of the left rear wheel, which wraps at its length.");
  VCHARGE_OPTION_GROUP(CanSignal, right_ticks, {}, "Counter of the right rear wheel.");
  VCHARGE_OPTION_GROUP(CanSignal, left_speed_m_per_s, {},
                       "Speed of the left rear wheel, instead of its counter.");
  VCHARGE_OPTION_GROUP(CanSignal, right_speed_m_per_s, {}, "Speed of the right rear wheel.");
  VCHARGE_OPTION_GROUP(CanSignal, backwards, {},
                       "Not 0 if the car rolls backwards, for counters without sign.");
  VCHARGE_OPTION_GROUP(CanSignal, steering_angle_rad, {},
                       "Angle of a virtual front wheel in the middle; the scale includes the steering gear.");
  VCHARGE_OPTION(double, metres_per_tick, 0.01, above(0.0).upTo(100.0), "Distance per tick of the counters.");
  VCHARGE_OPTION(double, max_speed_m_per_s, 60.0, above(0.0).upTo(1000.0),
                 "Speed beyond which a counter was reset.");
  VCHARGE_END_OPTIONS();
  void checkFields() const;

  /// False for the default options: the car sends no wheel data.
  bool isUsed() const { return left_ticks.isUsed() || left_speed_m_per_s.isUsed(); }
  bool hasTicks() const { return left_ticks.isUsed(); }
};

struct CanWheelCounts {
  uint64_t frames = 0;
  uint64_t too_short = 0;  ///< messages that end before one of their signals
  uint64_t wraps = 0;
  uint64_t resets = 0;  ///< counters that jumped, or may have wrapped during a long silence
};

/// Converts a car's messages to WheelTicks with unwrapped, continuous counters. Speeds are integrated to
/// ticks of kSpeedTick_m. Not thread safe.
class CanWheelDecoder {
 public:
  static constexpr double kSpeedTick_m = 1e-4;

  explicit CanWheelDecoder(const CanWheelOptions& options);
  /// Returns the ticks completed by this frame, at `stamp`: after the message with both counters, or after
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
