#pragma once

#include "vcharge_geometry/solvers/pluecker_line.h"

namespace vcharge {

/// Rays to a scene point at two instants, each in the rig frame of its instant.
struct RayMatch {
  Ray previous;
  Ray current;
  int previous_camera = 0;  ///< any label; used to draw samples across cameras
  int current_camera = 0;
  double quality = 1.0;  ///< higher for more reliable matches; used to draw samples
};

}  // namespace vcharge
