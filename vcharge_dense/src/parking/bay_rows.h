#pragma once

#include <vector>

#include <Eigen/Core>

#include "parking/ground_image.h"
#include "parking/paint_lines.h"
#include "vcharge_core/dense_maps/parking_bay.h"

namespace vcharge {

/// A line between two bays of a row, or at its end.
struct BayDivider {
  bool is_seen = false;  ///< otherwise inferred from the row: hidden by cars
};

/// Bays side by side: parallelograms of one size, with lines between them.
struct BayRow {
  BayKind kind = BayKind::kPerpendicular;
  Eigen::Vector2d entry_m;   ///< end of the first divider at the lane
  Eigen::Vector2d step_m;    ///< from one divider to the next
  Eigen::Vector2d depth_m;   ///< from the lane to the far end of a divider
  bool is_end_seen = false;  ///< otherwise `depth_m` is that of other rows, or a usual one
  double entry_sigma_m = 0.0, end_sigma_m = 0.0;
  std::vector<BayDivider> dividers;  ///< two or more
};

/// Groups painted lines into rows of bays: parallel lines of one length, at equal distances, whose ends at
/// the lane lie on a line. Lines that cars hide are inferred; where the ground is seen and bare, a row ends.
std::vector<BayRow> findBayRows(const GroundImage& ground, const std::vector<PaintLine>& lines);

}  // namespace vcharge
