#pragma once

#include <string>
#include <vector>

#include "vcharge_simulation/drive/drive_simulator.h"

namespace vcharge {

/// Log of candump of a car that sends these wheel speeds, at their stamps, as
/// config/driver/simulated_car.yaml of vcharge_config describes it: steering angle, then speeds.
std::string wheelCanLog(const std::vector<WheelSpeeds>& speeds);

}  // namespace vcharge
