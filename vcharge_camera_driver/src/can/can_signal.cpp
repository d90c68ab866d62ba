#include "vcharge_camera_driver/can_signal.h"

#include <cmath>

namespace vcharge {
namespace {

constexpr uint32_t kMaxStandardId = 0x7ff;
constexpr int kMaxBits = 64;

// Index of the i-th bit (0 is the lowest) of a number in the message. A big endian number starts at its
// highest bit: the bits of a byte from highest to lowest, then those of the next byte.
int bitIndex(const CanNumber& number, int i) {
  if (number.endianness == ByteOrder::kLittle) {
    return number.start_bit + i;
  }
  const int from_top = number.length - 1 - i;
  const int position = 8 * (number.start_bit / 8) + (7 - number.start_bit % 8) + from_top;
  return 8 * (position / 8) + (7 - position % 8);
}

int lastByte(const CanNumber& number) {
  return bitIndex(number, number.endianness == ByteOrder::kLittle ? number.length - 1 : 0) / 8;
}

}  // namespace

void CanNumber::checkFields() const {
  if (!isThere()) {
    const bool is_described = start_bit != 0 || is_signed || scale != 1.0 || offset != 0.0;
    requireField(!is_described, "length", "must be in [1, 64]", length);
    return;
  }
  requireField(lastByte(*this) < 8, "length", "the signal must end within 8 bytes", length);
  requireField(std::isfinite(scale) && scale != 0.0, "scale", "must be finite and not 0", scale);
  requireField(std::isfinite(offset), "offset", "must be finite", offset);
}

uint64_t CanNumber::mask() const {
  uint64_t mask = 0;
  for (int i = 0; i < length; ++i) {
    mask |= uint64_t{1} << bitIndex(*this, i);
  }
  return mask;
}

std::optional<uint64_t> CanNumber::rawBits(const CanFrame& frame) const {
  if (lastByte(*this) >= frame.size) {
    return std::nullopt;
  }
  uint64_t bits = 0;
  for (int i = 0; i < length; ++i) {
    const int index = bitIndex(*this, i);
    const uint64_t bit = frame.data.at(static_cast<size_t>(index / 8)) >> (index % 8) & 1U;
    bits |= bit << i;
  }
  return bits;
}

std::optional<double> CanNumber::value(const CanFrame& frame) const {
  const std::optional<uint64_t> bits = rawBits(frame);
  if (!bits) {
    return std::nullopt;
  }
  auto number = static_cast<double>(*bits);
  if (is_signed && (*bits >> (length - 1) & 1U) != 0) {
    number = -static_cast<double>((~*bits & (~uint64_t{0} >> (kMaxBits - length))) + 1);
  }
  return number * scale + offset;
}

void CanMultiplexor::checkFields() const {
  requireField(length > 0 || (start_bit == 0 && value == 0), "length", "must be in [1, 31]", length);
  if (length > 0) {
    number().checkFields();
    requireField(value <= (int64_t{1} << length) - 1, "value", "must fit into the multiplexor's bits", value);
  }
}

void CanSignal::checkFields() const {
  if (!isUsed()) {
    return;
  }
  requireField(isThere(), "length", "must be in [1, 64]", length);
  CanNumber::checkFields();
  requireField((mask() & plus.mask()) == 0, "plus.start_bit", "the part's bits must not be the signal's",
               plus.start_bit);
  requireField(((mask() | plus.mask()) & multiplexor.number().mask()) == 0, "multiplexor.start_bit",
               "the multiplexor's bits must not be the signal's", multiplexor.start_bit);
}

bool CanSignal::isIn(const CanFrame& frame) const {
  if (!isUsed() || frame.id != static_cast<uint32_t>(id) ||
      frame.is_extended != (frame.id > kMaxStandardId)) {
    return false;
  }
  if (multiplexor.length == 0) {
    return true;
  }
  const std::optional<uint64_t> chosen = multiplexor.number().rawBits(frame);
  return !chosen || *chosen == static_cast<uint64_t>(multiplexor.value);  // value() finds it too short
}

std::optional<double> CanSignal::value(const CanFrame& frame) const {
  if (multiplexor.length > 0 && !multiplexor.number().rawBits(frame)) {
    return std::nullopt;
  }
  const std::optional<double> first = CanNumber::value(frame);
  const std::optional<double> second = plus.isThere() ? plus.value(frame) : 0.0;
  return first && second ? std::optional<double>(*first + *second) : std::nullopt;
}

bool CanSignal::overlaps(const CanSignal& other) const {
  const CanMultiplexor& own = multiplexor;
  const CanMultiplexor& others = other.multiplexor;
  const bool never_together = own.length > 0 && own.number().mask() == others.number().mask() &&
                              own.endianness == others.endianness && own.value != others.value;
  return isUsed() && id == other.id && !never_together &&
         ((mask() | plus.mask()) & (other.mask() | other.plus.mask())) != 0;
}

}  // namespace vcharge
