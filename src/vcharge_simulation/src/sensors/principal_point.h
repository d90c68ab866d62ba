#pragma once

#include <Eigen/Core>

#include "vcharge_simulation/rendering/noise.h"

namespace vcharge {

/// Principal point within 5 pixels of the middle of a 1280x800 image, in the image scaled by `scale`. Pixel
/// centres have integer coordinates, so the image starts at -0.5.
inline Eigen::Vector2d randomPrincipalPoint(double scale, Random* random) {
  const double u0 = 639.5 + random->uniform(-5.0, 5.0);
  const double v0 = 399.5 + random->uniform(-5.0, 5.0);
  return {(u0 + 0.5) * scale - 0.5, (v0 + 0.5) * scale - 0.5};
}

}  // namespace vcharge
