#pragma once

#include <cstdint>

#include "scenes/lane_paths.h"
#include "vcharge_core/dense_maps/parking_bay.h"

namespace vcharge {

/// Sizes of a lot whose two double rows of bays lie between three lanes, mirrored at y = 0. The aisle at y =
/// -lanes.y_m serves the drives into bays: its bays are perpendicular and it is at least 6 m wide.
struct LotPlan {
  Lanes lanes;
  double drive_offset = 1.0;  ///< factor on the drives' distance from the middle of the lanes
  double free_bay_x_m = -9.1;

  // Used only for plans that are drawn.
  int bays_per_row = 16;
  double half_middle_aisle_m = 2.9;
  BayKind middle_bays = BayKind::kPerpendicular;  ///< along the middle lane
  BayKind north_bays = BayKind::kPerpendicular;   ///< inside the northern lane
  double bay_angle_rad = 1.1;                     ///< of angled bays to the lane
  double half_island_m = 0.3;                     ///< between the rows of a double row
  double to_row_end_m = 5.1;                      ///< from the middle of a crossing lane to the rows
  double half_outer_aisle_m = 3.15;               ///< of the outer lanes, on the outer side
  bool has_outer_rows[2] = {true, true};          ///< south, north
  double beyond_x_m = 3.6;                        ///< free ground beyond the middle of the crossing lanes

  /// Draws a plan; seed 0 gives the known one.
  static LotPlan fromSeed(uint64_t layout_seed);

  double rowHalf() const { return lanes.x_m - to_row_end_m; }
  /// Extent of a row across its lane.
  double depthOf(BayKind kind) const;
};

inline constexpr double kBayLength_m = 4.3;
/// Distance of the middle of the bays inside the southern lane from the lane.
inline constexpr double kInnerBays_m = 5.05;

}  // namespace vcharge
