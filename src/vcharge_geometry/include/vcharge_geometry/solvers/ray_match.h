#pragma once

#include "vcharge_geometry/solvers/pluecker_line.h"

namespace vcharge {

/// The same scene point seen at two instants, each ray in the rig's frame of its instant.
struct RayMatch {
  Ray previous;
  Ray current;
  int previous_camera = 0;  ///< any label; used to draw samples across cameras
  int current_camera = 0;
  double quality = 1.0;  ///< higher for matches more likely to be right; used to draw samples
};

}  // namespace vcharge
