#include "vcharge_camera_driver/can_wheel_options.h"

#include <cstdio>
#include <stdexcept>
#include <type_traits>

namespace vcharge {
namespace {

std::string hexadecimal(int id) {
  char text[16];
  std::snprintf(text, sizeof(text), "0x%03x", static_cast<unsigned>(id));
  return text;
}

}  // namespace

std::vector<std::pair<std::string, const CanSignal*>> CanWheelOptions::usedSignals() const {
  std::vector<std::pair<std::string, const CanSignal*>> used;
  forEachOption(*this, [&](const OptionDeclaration& option, const auto& field) {
    if constexpr (std::is_same_v<std::decay_t<decltype(field)>, CanSignal>) {
      if (field.isUsed()) {
        used.emplace_back(option.name, &field);
      }
    }
  });
  return used;
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
  requireField(front_left_speed_m_per_s.isUsed() == front_right_speed_m_per_s.isUsed(),
               "front_left_speed_m_per_s.id", "both front wheels or none must have a message",
               front_left_speed_m_per_s.id);
  requireField(!hasFrontWheels() || speeds, "front_left_speed_m_per_s.id",
               "the rear wheels must have speeds too", front_left_speed_m_per_s.id);
  requireField(!backwards.isThere() || backwards.isUsed(), "backwards.id", "must be given", backwards.id);
  requireField(!steering_angle_rad.isThere() || steering_angle_rad.isUsed(), "steering_angle_rad.id",
               "must be given", steering_angle_rad.id);
  for (const CanSignal* signal : {&left_ticks, &right_ticks}) {
    requireField(signal->length <= 32, "left_ticks.length", "counters have at most 32 bits", signal->length);
    requireField(signal->scale == 1.0 && signal->offset == 0.0, "left_ticks.scale",
                 "counters are not scaled (metres_per_tick does that)", signal->scale);
    requireField(!signal->plus.isThere(), "left_ticks.plus.length", "counters have one part",
                 signal->plus.length);
  }
  const auto used = usedSignals();
  for (size_t i = 0; i < used.size(); ++i) {
    for (size_t j = 0; j < i; ++j) {
      if (used[i].second->overlaps(*used[j].second)) {
        throw std::invalid_argument(used[i].first + ".start_bit: must take other bits of message " +
                                    hexadecimal(used[i].second->id) + " than " + used[j].first + ", is " +
                                    std::to_string(used[i].second->start_bit));
      }
    }
  }
}

}  // namespace vcharge
