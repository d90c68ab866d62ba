#pragma once

#include <vector>

#include <Eigen/Core>

#include "parking/ground_image.h"

namespace vcharge {

/// A straight painted line that is brighter than the ground on both sides.
struct PaintLine {
  Eigen::Vector2d from_m, to_m;  ///< ends of its middle
  double contrast = 0.0;         ///< of the logarithm of the brightness

  double length_m() const { return (to_m - from_m).norm(); }
  Eigen::Vector2d direction() const { return (to_m - from_m).normalized(); }
};

/// Painted lines of at least half a metre, in an order that depends on the image only.
std::vector<PaintLine> findPaintLines(const GroundImage& ground);

}  // namespace vcharge
