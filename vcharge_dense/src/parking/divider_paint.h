#pragma once

#include <Eigen/Core>

#include "parking/bay_lattice.h"
#include "parking/ground_image.h"

namespace vcharge {

/// What is seen along a divider: how many metres are painted, and how many are bare ground.
struct DividerPaint {
  double painted_m = 0.0, bare_m = 0.0;

  bool isLine() const { return painted_m >= kMinVisible_m && painted_m > 1.5 * bare_m; }
  /// Whether there may be a line of which little is seen.
  bool isUnclear() const { return bare_m < kMinVisible_m; }
};

/// Looks along a divider from its end at the lane. `line_contrast` is that of its paint, or of other lines.
DividerPaint paintAlong(const GroundImage& ground, const Eigen::Vector2d& entry_m,
                        const Eigen::Vector2d& depth_m, double line_contrast);

/// Contrast of the paler lines: distant ones and those in the shade.
double paleContrast(const LatticeLines& lines);

/// Length of the dividers of a row.
struct DividerLength {
  double length_m = 0.0, sigma_m = 0.0;
  bool is_seen = false;  ///< otherwise a usual one
};

/// The length on which the lines agree whose far ends are seen: bare ground or a kerb follows.
DividerLength lengthOf(const GroundImage& ground, const BayLattice& lattice, const LatticeLines& lines,
                       const BaySizes& sizes);

}  // namespace vcharge
