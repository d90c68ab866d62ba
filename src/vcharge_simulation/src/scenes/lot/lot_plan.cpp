#include "scenes/lot/lot_plan.h"

#include <algorithm>
#include <cmath>

#include "scenes/lot/parking_bays.h"
#include "vcharge_simulation/rendering/noise.h"

namespace vcharge {

double LotPlan::depthOf(BayKind kind) const {
  switch (kind) {
    case BayKind::kAngled:
      return kBayLength_m * std::sin(bay_angle_rad) + kBayWidth_m * std::cos(bay_angle_rad);
    case BayKind::kParallel:
      return 2.3;
    default:
      return kBayLength_m;
  }
}

namespace {

// Two corners of a drive on the inner side of two lanes need this distance between their middles.
constexpr double kLeastLaneDistance_m = 15.0;

}  // namespace

LotPlan LotPlan::fromSeed(uint64_t layout_seed) {
  LotPlan plan;
  if (layout_seed == 0) {
    return plan;
  }
  Random random(layout_seed * 9091U + 77U);
  const auto kind = [&] { return static_cast<BayKind>(random.index(3)); };
  plan.bays_per_row = 12 + random.index(5);
  plan.half_middle_aisle_m = random.uniform(2.5, 4.0);
  plan.middle_bays = kind();
  plan.north_bays = kind();
  plan.bay_angle_rad = random.uniform(0.8, 1.25);
  plan.half_island_m = random.uniform(0.2, 1.2);
  plan.to_row_end_m = random.uniform(2.5, 3.6) + 2.1;
  plan.half_outer_aisle_m = random.uniform(3.15, 4.2);
  plan.has_outer_rows[0] = random.chance(0.7);
  plan.has_outer_rows[1] = random.chance(0.7);
  plan.beyond_x_m = random.uniform(3.0, 5.0);
  plan.lanes.x_m = 0.5 * plan.bays_per_row * kBayWidth_m + plan.to_row_end_m;
  plan.lanes.y_m = plan.half_middle_aisle_m + plan.depthOf(plan.middle_bays) + 2.0 * plan.half_island_m +
                   kInnerBays_m + 0.5 * kBayLength_m;
  const double missing_m = std::max(0.0, kLeastLaneDistance_m - plan.lanes.y_m);
  plan.half_island_m += 0.5 * missing_m;
  plan.lanes.y_m += missing_m;
  plan.drive_offset = 0.5;
  // A bay of the row west of the middle, with room for the drives on both sides.
  const int bays_before = plan.bays_per_row / 2 - 2;
  plan.free_bay_x_m = (0.5 - 0.5 * plan.bays_per_row + bays_before) * kBayWidth_m;
  return plan;
}

}  // namespace vcharge
