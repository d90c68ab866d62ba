#pragma once

#include <vector>

#include "vcharge_camera_driver/v4l2_device.h"

namespace vcharge {

/// Integer, boolean and menu controls of an open device with their values.
std::vector<V4l2Control> listControls(int fd);

}  // namespace vcharge
