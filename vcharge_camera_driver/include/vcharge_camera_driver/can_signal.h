#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "vcharge_core/base/options.h"

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

/// Position and scaling of a number in a message, as in DBC files: little endian (Intel) numbers start at
/// their lowest bit, big endian (Motorola) numbers at their highest bit; bits are counted from the lowest of
/// byte 0. value = raw * scale + offset.
struct CanNumber {
  VCHARGE_BEGIN_OPTIONS(CanNumber);
  VCHARGE_OPTION(int, start_bit, 0, between(0, 63), "First bit, as in DBC files.");
  VCHARGE_OPTION(int, length, 0, between(0, 64), "Number of bits; 0: there is none.");
  VCHARGE_OPTION(ByteOrder, endianness, ByteOrder::kLittle, anyValue(), "Byte order.");
  VCHARGE_OPTION(bool, is_signed, false, anyValue(), "Whether the number is signed (two's complement).");
  VCHARGE_OPTION(double, scale, 1.0, anyValue(), "Factor of the raw number.");
  VCHARGE_OPTION(double, offset, 0.0, anyValue(), "Added to the scaled number.");
  VCHARGE_END_OPTIONS();
  void checkFields() const;

  bool isThere() const { return length > 0; }
  /// The bits of a message's data that the number takes; bit 0 is the lowest of byte 0.
  uint64_t mask() const;
  /// The raw bits; empty if the frame is too short.
  std::optional<uint64_t> rawBits(const CanFrame& frame) const;
  /// With sign, scale and offset.
  std::optional<double> value(const CanFrame& frame) const;
};

/// The number that tells which of several contents a message has.
struct CanMultiplexor {
  VCHARGE_BEGIN_OPTIONS(CanMultiplexor);
  VCHARGE_OPTION(int, start_bit, 0, between(0, 63), "First bit, as in DBC files.");
  VCHARGE_OPTION(int, length, 0, between(0, 31), "Number of bits; 0: the message is not multiplexed.");
  VCHARGE_OPTION(ByteOrder, endianness, ByteOrder::kLittle, anyValue(), "Byte order.");
  VCHARGE_OPTION(int, value, 0, notNegative(), "Value with which the message has the signal.");
  VCHARGE_END_OPTIONS();
  void checkFields() const;
  CanNumber number() const { return {start_bit, length, endianness}; }
};

/// A number of a message, the sum of two where the car sends it in parts.
struct CanSignal : CanNumber {
  VCHARGE_BEGIN_DERIVED_OPTIONS(CanSignal, CanNumber);
  VCHARGE_OPTION(int, id, -1, anyValue().upTo(0x1fffffff),
                 "Identifier of the message, extended above 0x7ff; negative: the car does not send it.");
  VCHARGE_OPTION_GROUP(CanNumber, plus, {}, "Second part in the same message, added to the first.");
  VCHARGE_OPTION_GROUP(CanMultiplexor, multiplexor, {}, "Tells whether a message has the signal.");
  VCHARGE_END_OPTIONS();
  void checkFields() const;

  bool isUsed() const { return id >= 0; }
  /// True if the frame is the signal's message, with the signal's multiplexor value if it is multiplexed.
  bool isIn(const CanFrame& frame) const;
  /// The value with both parts; empty if the frame is too short. Ignores the frame's id.
  std::optional<double> value(const CanFrame& frame) const;
  /// True if a message can have both signals and they take some of the same bits.
  bool overlaps(const CanSignal& other) const;
};

}  // namespace vcharge
