#pragma once

#include <functional>

namespace vcharge {

/// Height of the ground in the world, in metres; safe to call from many threads. A null function stands for
/// level ground at z = 0.
using GroundHeight = std::function<double(double x_m, double y_m)>;

}  // namespace vcharge
