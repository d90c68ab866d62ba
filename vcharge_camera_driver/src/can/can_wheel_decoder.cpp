#include "vcharge_camera_driver/can_wheel_decoder.h"

#include <cmath>

namespace vcharge {
namespace {

constexpr int kMaxStandardId = 0x7ff;
constexpr int kMaxBits = 64;
constexpr double kMaxIntegration_s = 0.5;           // longest interval over which a speed is integrated
constexpr double kSlackTicks = 4.0;                 // tolerance for inaccurate stamps
constexpr double kMaxAcceleration_m_per_s2 = 50.0;  // maximum of a wheel that starts to spin

// Index of the i-th bit (0 is the lowest) of a big endian signal that starts at its highest bit: the bits of
// a byte from highest to lowest, then those of the next byte.
int bigEndianBit(const CanSignal& signal, int i) {
  const int from_top = signal.length - 1 - i;
  const int position = 8 * (signal.start_bit / 8) + (7 - signal.start_bit % 8) + from_top;
  return 8 * (position / 8) + (7 - position % 8);
}

int lastByte(const CanSignal& signal) {
  return signal.endianness == ByteOrder::kLittle ? (signal.start_bit + signal.length - 1) / 8
                                                 : bigEndianBit(signal, 0) / 8;
}

}  // namespace

void CanSignal::checkFields() const {
  if (!isUsed()) {
    return;
  }
  requireField(length >= 1, "length", "must be in [1, 64]", length);
  requireField(lastByte(*this) < 8, "length", "the signal must end within 8 bytes", length);
  requireField(std::isfinite(scale) && scale != 0.0, "scale", "must be finite and not 0", scale);
  requireField(std::isfinite(offset), "offset", "must be finite", offset);
}

bool CanSignal::isIn(const CanFrame& frame) const {
  return isUsed() && frame.id == static_cast<uint32_t>(id) && frame.is_extended == (id > kMaxStandardId);
}

std::optional<uint64_t> CanSignal::rawBits(const CanFrame& frame) const {
  if (lastByte(*this) >= frame.size) {
    return std::nullopt;
  }
  uint64_t bits = 0;
  for (int i = 0; i < length; ++i) {
    const int index = endianness == ByteOrder::kLittle ? start_bit + i : bigEndianBit(*this, i);
    const uint64_t bit = frame.data.at(static_cast<size_t>(index / 8)) >> (index % 8) & 1U;
    bits |= bit << i;
  }
  return bits;
}

std::optional<double> CanSignal::value(const CanFrame& frame) const {
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

void CanWheelOptions::checkFields() const {
  const bool ticks = left_ticks.isUsed() && right_ticks.isUsed();
  const bool speeds = left_speed_m_per_s.isUsed() && right_speed_m_per_s.isUsed();
  const bool some_ticks = left_ticks.isUsed() || right_ticks.isUsed();
  const bool some_speeds = left_speed_m_per_s.isUsed() || right_speed_m_per_s.isUsed();
  if ((ticks && speeds) || some_ticks != ticks || some_speeds != speeds) {
    throw std::invalid_argument(
        "left_ticks: both wheels must have a message, either with ticks or with speeds; its id is " +
        std::to_string(left_ticks.id));
  }
  for (const CanSignal* signal : {&left_ticks, &right_ticks}) {
    requireField(signal->length <= 32, "left_ticks.length", "counters have at most 32 bits", signal->length);
    requireField(signal->scale == 1.0 && signal->offset == 0.0, "left_ticks.scale",
                 "counters are not scaled (metres_per_tick does that)", signal->scale);
  }
}

CanWheelDecoder::CanWheelDecoder(const CanWheelOptions& options)
    : options_(options), metres_per_tick_(options.hasTicks() ? options.metres_per_tick : kSpeedTick_m) {
  options.validate();
  if (!options.isUsed()) {
    throw std::invalid_argument("left_ticks: expected a message with ticks or speeds");
  }
  left_.signal = options_.hasTicks() ? &options_.left_ticks : &options_.left_speed_m_per_s;
  left_.speed_error_m_per_s = right_.speed_error_m_per_s = options_.max_speed_m_per_s;
  right_.signal = options_.hasTicks() ? &options_.right_ticks : &options_.right_speed_m_per_s;
}

void CanWheelDecoder::count(uint64_t raw, Timestamp stamp, Wheel* wheel) {
  if (wheel->raw) {
    // Chooses, among all changes that the counter's bits allow, the one closest to the prediction from the
    // last speed. The maximum error of the prediction tells whether only one change is possible.
    const double elapsed_s = std::max(0.0, toSeconds(stamp - wheel->stamp));
    const double tick_m = options_.metres_per_tick;
    const auto range = static_cast<double>(int64_t{1} << wheel->signal->length);
    const double expected = wheel->speed_m_per_s * elapsed_s / tick_m;
    const double margin =
        (wheel->speed_error_m_per_s + 0.5 * kMaxAcceleration_m_per_s2 * elapsed_s) * elapsed_s / tick_m +
        kSlackTicks;
    const double difference = static_cast<double>(raw) - static_cast<double>(*wheel->raw);
    const double change = difference + range * std::round((expected - difference) / range);
    if (margin >= 0.5 * range || std::abs(change - expected) > margin ||
        std::abs(change) * tick_m > options_.max_speed_m_per_s * elapsed_s + kSlackTicks * tick_m) {
      ++counts_.resets;
      wheel->speed_m_per_s = 0.0;
      wheel->speed_error_m_per_s = options_.max_speed_m_per_s;
    } else {
      counts_.wraps += change != difference ? 1 : 0;
      wheel->ticks += static_cast<int64_t>(backwards_ ? -change : change);
      if (elapsed_s > 0.0) {
        wheel->speed_m_per_s = change * tick_m / elapsed_s;
        wheel->speed_error_m_per_s = 2.0 * tick_m / elapsed_s;
      }
    }
  }
  wheel->raw = raw;
}

void CanWheelDecoder::integrate(double speed_m_per_s, Timestamp stamp, Wheel* wheel) {
  const double signed_speed = backwards_ ? -speed_m_per_s : speed_m_per_s;
  if (wheel->raw) {
    const double elapsed_s = toSeconds(stamp - wheel->stamp);
    if (elapsed_s > kMaxIntegration_s || elapsed_s < 0.0 ||
        std::abs(signed_speed) > options_.max_speed_m_per_s) {
      ++counts_.resets;
    } else {
      wheel->remainder_m += 0.5 * (wheel->speed_m_per_s + signed_speed) * elapsed_s;
      const auto ticks = static_cast<int64_t>(std::floor(wheel->remainder_m / kSpeedTick_m));
      wheel->ticks += ticks;
      wheel->remainder_m -= static_cast<double>(ticks) * kSpeedTick_m;
    }
  }
  wheel->speed_m_per_s = std::abs(signed_speed) > options_.max_speed_m_per_s ? 0.0 : signed_speed;
  wheel->raw = 0;
}

bool CanWheelDecoder::update(const CanFrame& frame, Timestamp stamp, Wheel* wheel) {
  if (!wheel->signal->isIn(frame)) {
    return false;
  }
  const std::optional<uint64_t> raw = wheel->signal->rawBits(frame);
  if (!raw) {
    ++counts_.too_short;
    return false;
  }
  if (options_.hasTicks()) {
    count(*raw, stamp, wheel);
  } else {
    integrate(*wheel->signal->value(frame), stamp, wheel);
  }
  wheel->stamp = stamp;
  wheel->is_fresh = true;
  return true;
}

std::optional<WheelTicks> CanWheelDecoder::add(const CanFrame& frame, Timestamp stamp) {
  ++counts_.frames;
  const auto read = [&](const CanSignal& signal) {
    const std::optional<double> value = signal.isIn(frame) ? signal.value(frame) : std::nullopt;
    counts_.too_short += signal.isIn(frame) && !value ? 1 : 0;
    return value;
  };
  backwards_ = read(options_.backwards).value_or(backwards_ ? 1.0 : 0.0) != 0.0;
  steering_angle_rad_ = read(options_.steering_angle_rad).value_or(steering_angle_rad_);
  const bool left = update(frame, stamp, &left_);
  const bool right = update(frame, stamp, &right_);
  if (!(left || right) || !left_.is_fresh || !right_.is_fresh) {
    return std::nullopt;
  }
  left_.is_fresh = false;
  right_.is_fresh = false;
  WheelTicks ticks;
  ticks.stamp = stamp;
  ticks.left_ticks = left_.ticks;
  ticks.right_ticks = right_.ticks;
  ticks.metres_per_tick = metres_per_tick_;
  ticks.steering_angle_rad = steering_angle_rad_;
  return ticks;
}

}  // namespace vcharge
