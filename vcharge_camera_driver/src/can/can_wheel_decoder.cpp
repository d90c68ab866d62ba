#include "vcharge_camera_driver/can_wheel_decoder.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace vcharge {
namespace {

constexpr double kSlackTicks = 4.0;                 // tolerance for inaccurate stamps
constexpr double kMaxAcceleration_m_per_s2 = 50.0;  // maximum of a wheel that starts to spin

}  // namespace

CanWheelDecoder::CanWheelDecoder(const CanWheelOptions& options) : options_(options) {
  options.validate();
  if (!options.isUsed()) {
    throw std::invalid_argument("left_ticks: expected a message with ticks or speeds");
  }
  left_ticks_.signal = &options_.left_ticks;
  right_ticks_.signal = &options_.right_ticks;
  left_ticks_.speed_error_m_per_s = right_ticks_.speed_error_m_per_s = options_.max_speed_m_per_s;
  left_speed_.signal = &options_.left_speed_m_per_s;
  right_speed_.signal = &options_.right_speed_m_per_s;
  front_left_speed_.signal = &options_.front_left_speed_m_per_s;
  front_right_speed_.signal = &options_.front_right_speed_m_per_s;
  backwards_.signal = &options_.backwards;
  steering_.signal = &options_.steering_angle_rad;
}

double CanWheelDecoder::Value::at(Timestamp now) const {
  return value && std::abs(toSeconds(now - stamp)) <= kMaxAge_s ? *value : WheelSpeeds::kUnknown;
}

void CanWheelDecoder::count(const CanFrame& frame, Timestamp stamp, Counter* counter) {
  if (!counter->signal->isIn(frame)) {
    return;
  }
  const std::optional<uint64_t> raw = counter->signal->rawBits(frame);
  if (!raw) {
    ++counts_.too_short;
    return;
  }
  if (counter->raw) {
    // Chooses, among all changes that the counter's bits allow, the one closest to the prediction from the
    // last speed. The maximum error of the prediction tells whether only one change is possible.
    const double elapsed_s = std::max(0.0, toSeconds(stamp - counter->stamp));
    const double tick_m = options_.metres_per_tick;
    const auto range = static_cast<double>(int64_t{1} << counter->signal->length);
    const double expected = counter->speed_m_per_s * elapsed_s / tick_m;
    const double margin =
        (counter->speed_error_m_per_s + 0.5 * kMaxAcceleration_m_per_s2 * elapsed_s) * elapsed_s / tick_m +
        kSlackTicks;
    const double difference = static_cast<double>(*raw) - static_cast<double>(*counter->raw);
    const double change = difference + range * std::round((expected - difference) / range);
    if (margin >= 0.5 * range || std::abs(change - expected) > margin ||
        std::abs(change) * tick_m > options_.max_speed_m_per_s * elapsed_s + kSlackTicks * tick_m) {
      ++counts_.resets;
      counter->speed_m_per_s = 0.0;
      counter->speed_error_m_per_s = options_.max_speed_m_per_s;
    } else {
      counts_.wraps += change != difference ? 1 : 0;
      counter->ticks += static_cast<int64_t>(rolls_backwards_ ? -change : change);
      if (elapsed_s > 0.0) {
        counter->speed_m_per_s = change * tick_m / elapsed_s;
        counter->speed_error_m_per_s = 2.0 * tick_m / elapsed_s;
      }
    }
  }
  counter->raw = raw;
  counter->stamp = stamp;
  counter->is_fresh = true;
}

bool CanWheelDecoder::read(const CanFrame& frame, Timestamp stamp, Value* value) {
  if (!value->signal->isIn(frame)) {
    return false;
  }
  const std::optional<double> read = value->signal->value(frame);
  counts_.too_short += read ? 0 : 1;
  if (!read) {
    return false;
  }
  value->value = read;
  value->stamp = stamp;
  return true;
}

bool CanWheelDecoder::readSpeed(const CanFrame& frame, Timestamp stamp, Value* speed) {
  if (!read(frame, stamp, speed)) {
    return false;
  }
  if (std::abs(*speed->value) > options_.max_speed_m_per_s) {
    ++counts_.invalid;
    speed->value.reset();
    return false;
  }
  *speed->value *= rolls_backwards_ ? -1.0 : 1.0;
  return true;
}

std::optional<WheelMeasurement> CanWheelDecoder::addTicks(const CanFrame& frame, Timestamp stamp) {
  count(frame, stamp, &left_ticks_);
  count(frame, stamp, &right_ticks_);
  if (!left_ticks_.is_fresh || !right_ticks_.is_fresh) {
    return std::nullopt;
  }
  left_ticks_.is_fresh = right_ticks_.is_fresh = false;
  WheelTicks ticks;
  ticks.stamp = stamp;
  ticks.left_ticks = left_ticks_.ticks;
  ticks.right_ticks = right_ticks_.ticks;
  ticks.metres_per_tick = options_.metres_per_tick;
  ticks.steering_angle_rad = steering_.at(stamp);
  return ticks;
}

std::optional<WheelMeasurement> CanWheelDecoder::addSpeeds(const CanFrame& frame, Timestamp stamp) {
  readSpeed(frame, stamp, &front_left_speed_);
  readSpeed(frame, stamp, &front_right_speed_);
  const bool left = readSpeed(frame, stamp, &left_speed_);
  const bool right = readSpeed(frame, stamp, &right_speed_);
  if (!(left || right) || !left_speed_.value || !right_speed_.value) {
    return std::nullopt;
  }
  WheelSpeeds speeds;
  speeds.stamp = stamp;
  speeds.rear_left_m_per_s = *left_speed_.value;
  speeds.rear_right_m_per_s = *right_speed_.value;
  speeds.front_left_m_per_s = front_left_speed_.at(stamp);
  speeds.front_right_m_per_s = front_right_speed_.at(stamp);
  speeds.steering_angle_rad = steering_.at(stamp);
  left_speed_.value.reset();  // each is used once
  right_speed_.value.reset();
  return speeds;
}

std::optional<WheelMeasurement> CanWheelDecoder::add(const CanFrame& frame, Timestamp stamp) {
  ++counts_.frames;
  if (read(frame, stamp, &backwards_)) {
    rolls_backwards_ = options_.backwards_value < 0 ? *backwards_.value != 0.0
                                                    : *backwards_.value == options_.backwards_value;
  }
  read(frame, stamp, &steering_);
  return options_.hasTicks() ? addTicks(frame, stamp) : addSpeeds(frame, stamp);
}

}  // namespace vcharge
