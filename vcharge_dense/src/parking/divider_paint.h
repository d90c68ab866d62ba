#pragma once

#include <vector>

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

/// Where the dividers of a row begin and end, in metres along them from the lattice's points at the lane.
struct DividerExtent {
  double begin_m = 0.0, end_m = 0.0;
  double end_sigma_m = 0.0;
  bool is_end_seen = false;  ///< otherwise the length is a usual one, or what is seen if it is longer

  double length_m() const { return end_m - begin_m; }
};

/// Extent of the paint that most dividers of a row have in common: cars hide parts of each.
DividerExtent extentOf(const GroundImage& ground, const BayLattice& lattice, const std::vector<int>& numbers,
                       double line_contrast, const BaySizes& sizes);

}  // namespace vcharge
