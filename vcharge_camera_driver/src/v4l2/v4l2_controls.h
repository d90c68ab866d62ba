#pragma once

#include <vector>

#include "vcharge_camera_driver/v4l2_device.h"

namespace vcharge {

/// The controls of an open device that hold a number, a truth value or a choice, with their values.
std::vector<V4l2Control> listControls(int fd);

}  // namespace vcharge
