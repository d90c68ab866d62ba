#pragma once

#include <functional>

namespace vcharge {

/// Height of the ground in the world frame, in metres. Must be thread safe. A null function means level
/// ground at z = 0.
using GroundHeight = std::function<double(double x_m, double y_m)>;

}  // namespace vcharge
