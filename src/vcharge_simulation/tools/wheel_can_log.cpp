#include "wheel_can_log.h"

#include <cmath>
#include <cstdio>
#include <initializer_list>

namespace vcharge {

namespace {

constexpr double kSpeedStep_m_per_s = 0.001;
constexpr double kAngleStep_rad = 1e-4;
constexpr int64_t kUnknown = -32768;  // decodes to a speed that no car has

// Signed 16-bit numbers, the low byte first.
std::string frameOf(Timestamp stamp, int id, double step, std::initializer_list<double> values) {
  char text[64];
  std::snprintf(text, sizeof(text), "(%lld.%06lld) can0 %03X#",
                static_cast<long long>(stamp.nanoseconds() / 1'000'000'000),
                static_cast<long long>(stamp.nanoseconds() / 1000 % 1'000'000), static_cast<unsigned>(id));
  std::string frame = text;
  for (const double value : values) {
    const int64_t raw = std::isfinite(value) ? std::llround(value / step) : kUnknown;
    std::snprintf(text, sizeof(text), "%02X%02X", static_cast<unsigned>(raw & 0xFF),
                  static_cast<unsigned>(raw >> 8 & 0xFF));
    frame += text;
  }
  return frame + "\n";
}

}  // namespace

std::string wheelCanLog(const std::vector<WheelSpeeds>& speeds) {
  std::string log;
  for (const WheelSpeeds& each : speeds) {
    log += frameOf(each.stamp, 0x101, kAngleStep_rad, {each.steering_angle_rad});
    log += frameOf(
        each.stamp, 0x102, kSpeedStep_m_per_s,
        {each.rear_left_m_per_s, each.rear_right_m_per_s, each.front_left_m_per_s, each.front_right_m_per_s});
  }
  return log;
}

}  // namespace vcharge
