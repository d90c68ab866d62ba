#pragma once

#include <string>
#include <utility>
#include <vector>

#include "vcharge_camera_driver/can_signal.h"

namespace vcharge {

/// The car's messages: counters or speeds of both rear wheels, and optionally speeds of the front wheels, the
/// direction and the steering angle.
struct CanWheelOptions {
  VCHARGE_BEGIN_OPTIONS(CanWheelOptions);
  VCHARGE_OPTION_GROUP(CanSignal, left_ticks, {},
                       "Counter of the left rear wheel, which wraps at its length.");
  VCHARGE_OPTION_GROUP(CanSignal, right_ticks, {}, "Counter of the right rear wheel.");
  VCHARGE_OPTION_GROUP(CanSignal, left_speed_m_per_s, {},
                       "Speed of the left rear wheel, instead of its counter.");
  VCHARGE_OPTION_GROUP(CanSignal, right_speed_m_per_s, {}, "Speed of the right rear wheel.");
  VCHARGE_OPTION_GROUP(CanSignal, front_left_speed_m_per_s, {},
                       "Speed of the left front wheel, to find slip; only with speeds of the rear wheels.");
  VCHARGE_OPTION_GROUP(CanSignal, front_right_speed_m_per_s, {}, "Speed of the right front wheel.");
  VCHARGE_OPTION_GROUP(CanSignal, backwards, {},
                       "Tells that the car rolls backwards, for counters and speeds without sign.");
  VCHARGE_OPTION(int, backwards_value, -1, anyValue(),
                 "Value of `backwards` that means so, as of a gear; negative: all but 0.");
  VCHARGE_OPTION_GROUP(CanSignal, steering_angle_rad, {},
                       "Angle of a virtual front wheel in the middle; the scale includes the steering gear.");
  VCHARGE_OPTION(double, metres_per_tick, 0.01, above(0.0).upTo(100.0), "Distance per tick of the counters.");
  VCHARGE_OPTION(double, max_speed_m_per_s, 60.0, above(0.0).upTo(1000.0),
                 "Speed beyond which a counter was reset, or a speed is not valid.");
  VCHARGE_END_OPTIONS();
  void checkFields() const;

  /// False for the default options: the car sends no wheel data.
  bool isUsed() const { return left_ticks.isUsed() || left_speed_m_per_s.isUsed(); }
  bool hasTicks() const { return left_ticks.isUsed(); }
  bool hasFrontWheels() const { return front_left_speed_m_per_s.isUsed(); }
  /// The signals that the car sends, with their names.
  std::vector<std::pair<std::string, const CanSignal*>> usedSignals() const;
};

}  // namespace vcharge
