#include "scenes/garage/garage_plan.h"

#include <algorithm>
#include <cmath>

#include "vcharge_simulation/rendering/noise.h"

namespace vcharge {

namespace {

constexpr double kBeam_m = 0.33;
constexpr double kLowestBeam_m = 2.05;
constexpr double kBesideMiddleLane_m = 2.9;
constexpr double kBesideOuterLane_m = 17.0;

}  // namespace

double GaragePlan::shifted(double y) const {
  const double beyond = std::abs(y);
  const double shift_m =
      beyond < kBesideMiddleLane_m ? 0.0 : widening_m + (beyond < kBesideOuterLane_m ? 0.0 : wall_widening_m);
  return y + (y < 0.0 ? -shift_m : shift_m);
}

GaragePlan GaragePlan::fromSeed(uint64_t layout_seed) {
  GaragePlan plan;
  if (layout_seed == 0) {
    return plan;
  }
  Random random(layout_seed * 7013U + 41U);
  plan.bays_per_row = 13 + random.index(6);
  plan.bays_per_pillar = 2 + random.index(3);
  plan.pillars_beside_rows = false;
  plan.widening_m = random.uniform(-0.2, 1.1);
  plan.wall_widening_m = random.uniform(0.0, 1.2);
  plan.lanes.x_m = 3.9 - plan.firstBay();
  plan.lanes.y_m = plan.shifted(plan.lanes.y_m);
  const double end_x = plan.lanes.x_m + random.uniform(4.2, 7.0);
  const double end_y = plan.shifted(kGarageArea.max_y);
  plan.area = {-end_x, -end_y, end_x, end_y};
  const int bays_before = plan.bays_per_row / 2 - 2;
  plan.free_bay_x_m = plan.firstBay() + (bays_before + 0.5) * kGarageBayWidth_m;
  plan.height_m = random.uniform(2.1, 3.0);
  plan.beam_height_m = std::max(kLowestBeam_m, plan.height_m - kBeam_m);
  plan.pillar_width_m = random.uniform(0.3, 0.5);
  plan.has_round_pillars = random.chance(0.5);
  plan.has_lamps_over_bays = random.chance(0.6);
  plan.lamp_strength = random.uniform(0.7, 1.2) * (plan.has_lamps_over_bays ? 1.0 : 1.3);
  plan.walls.tone = random.uniform(0.4, 0.75);
  plan.walls.band_m = random.chance(0.6) ? random.uniform(0.3, 1.6) : 0.0;
  plan.walls.band_tone = random.uniform(0.4, 0.85);
  plan.walls.fixture_gaps = random.uniform(1.0, 5.0);
  return plan;
}

}  // namespace vcharge
