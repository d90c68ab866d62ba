#include "scenes/garage/garage_layout.h"

#include <cmath>

#include "vcharge_simulation/rendering/noise.h"

namespace vcharge {

namespace {

constexpr double kHalfPi = 1.57079632679489661923;
constexpr double kOccupiedBays = 0.6;
constexpr double kLampHeight_m = 2.34;
constexpr double kLampLength_m = 1.5;
constexpr double kWallBays_m = 21.1;  // centres of the rows along the northern and southern wall
constexpr double kOuterBays_m = 10.1;
constexpr double kInnerBays_m = 5.3;
constexpr double kWallPillars_m = 18.9;  // slightly inside the open end of the bays
constexpr double kMiddlePillars_m = 7.7;

void addBays(GarageLayout* layout) {
  int number = 1;
  for (const double side : {-1.0, 1.0}) {
    for (const double across : {kInnerBays_m, kOuterBays_m, kWallBays_m}) {
      const GaragePlan& plan = layout->plan;
      const double yaw_rad = across == kOuterBays_m ? -side * kHalfPi : side * kHalfPi;
      for (int i = 0; i < plan.bays_per_row; ++i) {
        const double x = plan.firstBay() + (i + 0.5) * kBayWidth_m;
        const bool keep_free =
            side < 0.0 && across == kOuterBays_m && std::abs(x - plan.free_bay_x_m) < 0.5 * kBayWidth_m;
        layout->bays.push_back({x, plan.shifted(side * across), yaw_rad, number++, keep_free,
                                BayKind::kPerpendicular, false, kGarageBayLength_m});
      }
    }
  }
}

void addPillars(GarageLayout* layout) {
  const GaragePlan& plan = layout->plan;
  const int last = plan.bays_per_row + (plan.pillars_beside_rows ? 1 : 0);
  int column = 1;
  for (int i = 0; i <= last; i += plan.bays_per_pillar, ++column) {
    const double x = plan.firstBay() + i * kBayWidth_m;
    layout->beam_x.push_back(x);
    char row = 'A';
    for (const double y : {-kWallPillars_m, -kMiddlePillars_m, kMiddlePillars_m, kWallPillars_m}) {
      layout->pillars.push_back({x, plan.shifted(y), row++ + std::to_string(column)});
    }
  }
  layout->beam_y = {plan.shifted(-kMiddlePillars_m), plan.shifted(kMiddlePillars_m)};
}

// Lamps between the beams, over the lanes and some bays. A few are weak; which ones depends on the day.
void addLamps(uint64_t seed, int day, GarageLayout* layout) {
  const GaragePlan& plan = layout->plan;
  Random random(seed * 17U + 3U + 1000U * static_cast<uint64_t>(day));
  const auto add = [&](double x, double y, bool along_x) {
    const double strength = plan.lamp_strength * random.uniform(2.2, 3.0) * (random.chance(0.1) ? 0.25 : 1.0);
    const double half_m = 0.5 * kLampLength_m;
    layout->lamps.push_back(
        {Eigen::Vector3d(x, plan.shifted(y), kLampHeight_m + plan.lift()).cast<float>(),
         Eigen::Vector3d(along_x ? half_m : 0.0, along_x ? 0.0 : half_m, 0.0).cast<float>(),
         static_cast<float>(strength)});
  };
  const double spacing_m = plan.bays_per_pillar * kBayWidth_m;
  for (int i = 0; i < plan.bays_per_row / plan.bays_per_pillar + 1; ++i) {
    const double x = plan.firstBay() + (i + 0.5) * spacing_m;
    for (const double y : {-15.5, 0.0, 15.5}) {
      add(x, y, true);
    }
    if (plan.has_lamps_over_bays) {
      add(x, i % 2 == 0 ? 10.3 : -10.3, false);
      add(x, i % 2 == 0 ? -21.0 : 21.0, false);
    }
  }
  for (const double x : {-plan.lanes.x_m - 0.3, plan.lanes.x_m + 0.3}) {
    for (const double y : {-20.5, -11.0, -3.8, 3.8, 11.0, 20.5}) {
      add(x, y, false);
    }
  }
}

}  // namespace

GarageLayout makeGarageLayout(uint64_t seed, const Day& day, uint64_t layout_seed) {
  GarageLayout layout;
  layout.plan = GaragePlan::fromSeed(layout_seed);
  addBays(&layout);
  addPillars(&layout);
  addLamps(seed, day.number, &layout);
  layout.cars = parkCars(layout.bays, kOccupiedBays, seed + 90U, day);
  return layout;
}

}  // namespace vcharge
