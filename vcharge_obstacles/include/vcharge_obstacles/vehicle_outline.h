#pragma once

namespace vcharge {

/// Rectangle around the vehicle, in its own frame (x forward, y left).
struct VehicleOutline {
  double front_m = 0.0;  ///< front end along x
  double rear_m = 0.0;   ///< rear end along x, below front_m
  double half_width_m = 0.0;
};

}  // namespace vcharge
