#include "scenes/lot/lot_layout.h"

#include <algorithm>
#include <cmath>

#include "scenes/lot/drawn_lot.h"
#include "vcharge_simulation/rendering/noise.h"

namespace vcharge {

namespace {

constexpr double kHalfPi = 1.57079632679489661923;
constexpr double kOccupiedBays = 0.62;

void addBays(LotLayout* layout) {
  int number = 1;
  const auto addRow = [&](double y, double yaw_rad, double first_x, int count) {
    for (int i = 0; i < count; ++i) {
      const double x = first_x + (i + 0.5) * kBayWidth_m;
      const bool keep_free = y == kFreeBayY_m && std::abs(x - kFreeBayX_m) < 0.5 * kBayWidth_m;
      layout->bays.push_back({x, y, yaw_rad, number++, keep_free});
    }
  };
  for (const double side : {-1.0, 1.0}) {
    addRow(side * 5.05, side * kHalfPi, -20.8, 16);                    // along the middle lane
    addRow(side * std::abs(kFreeBayY_m), -side * kHalfPi, -20.8, 16);  // along the outer lanes, inner side
    addRow(side * 20.3, side * kHalfPi, -23.4, 18);                    // along the outer lanes, outer side
  }
}

void addPaving(LotLayout* layout) {
  constexpr float kEnd = 1e3F;
  constexpr float kPlaza = 29.6F;
  layout->paving = {
      {kPlaza, -4.0F, kEnd, kEnd, Paving::kSlabs},   {kPlaza, -kEnd, kEnd, kEnd, Paving::kCobbles},
      {-kEnd, -3.0F, kEnd, 3.0F, Paving::kCobbles},  {-kEnd, -kEnd, -22.9F, kEnd, Paving::kCobbles},
      {-kEnd, 12.0F, kEnd, 18.0F, Paving::kCobbles}, {-kEnd, 3.0F, kEnd, 12.0F, Paving::kBricks},
      {-kEnd, 18.0F, kEnd, kEnd, Paving::kBricks}};
}

void addIslands(LotLayout* layout) {
  for (const double side : {-1.0, 1.0}) {
    const auto row = [&](double near_y, double far_y, double min_x, double max_x) {
      layout->islands.push_back(
          {min_x, std::min(side * near_y, side * far_y), max_x, std::max(side * near_y, side * far_y)});
    };
    row(7.2, 7.8, -20.8, 20.8);  // between the double rows
    row(3.0, 12.0, 20.9, 22.9);  // at the ends of the double rows
    row(3.0, 12.0, -22.9, -20.9);
    row(22.7, 29.0, -38.0, 38.0);  // around the lot
  }
  layout->islands.push_back({-39.5, -22.7, -29.6, 22.7});
}

void addPlants(Random* random, LotLayout* layout) {
  const auto tree = [&](double x, double y, double low, double high) {
    layout->trees.push_back({x, y, layout->groundHeight(x, y), random->uniform(low, high),
                             random->uniform(0.0, 6.28), random->index(kNumSmallTrees)});
  };
  const auto bush = [&](double x, double y, double low, double high) {
    const double radius = random->uniform(low, high);
    layout->bushes.push_back({x, y, layout->groundHeight(x, y), radius, radius * random->uniform(1.0, 1.7),
                              static_cast<uint32_t>(random->bits())});
  };
  for (const double side : {-1.0, 1.0}) {
    for (const double end : {-1.0, 1.0}) {
      tree(end * 21.9, side * random->uniform(7.0, 8.0), 0.7, 0.9);
      bush(end * 21.9, side * 4.3, 0.5, 0.75);
      bush(end * 21.9, side * 10.6, 0.5, 0.75);
    }
    layout->hedges.push_back({{-20.4, side * 7.5 - 0.22, -2.0, side * 7.5 + 0.22}, kKerbHeight_m, 0.75});
    layout->hedges.push_back({{1.5, side * 7.5 - 0.22, 20.4, side * 7.5 + 0.22}, kKerbHeight_m, 0.95});
    for (double x = -36.0; x < 37.0; x += random->uniform(4.0, 7.5)) {
      tree(x, side * random->uniform(24.2, 27.5), 0.75, 1.25);
    }
    for (double x = -37.0; x < 37.0; x += random->uniform(1.6, 4.2)) {
      bush(x, side * random->uniform(23.4, 25.2), 0.45, 1.15);
    }
  }
  for (double y = -21.0; y < 22.0; y += random->uniform(4.5, 8.0)) {
    tree(random->uniform(-36.0, -31.5), y, 0.8, 1.2);
  }
  for (double y = -21.0; y < 22.0; y += random->uniform(1.8, 4.0)) {
    bush(random->uniform(-32.0, -30.4), y, 0.4, 1.0);
  }
  layout->hedges.push_back({{-38.5, -20.0, -37.5, 20.0}, kKerbHeight_m, 1.7});
  for (const double y : {-17.0, -8.0, 2.0, 11.0}) {
    const double shifted_y = y + random->uniform(-1.5, 1.5);
    tree(random->uniform(32.5, 34.5), shifted_y, 0.7, 1.0);
  }
}

// Tall trees behind the lot's fence, which hide most of the houses.
void addWoods(uint64_t seed, LotLayout* layout) {
  Random random(seed * 69U + 5U);
  const auto tree = [&](double x, double y) {
    layout->trees.push_back({x, y, 0.0, random.uniform(1.1, 1.7), random.uniform(0.0, 6.28),
                             kNumSmallTrees + random.index(kNumTallTrees)});
  };
  for (const double side : {-1.0, 1.0}) {
    for (double x = -37.0; x < 37.0; x += random.uniform(3.0, 8.0)) {
      tree(x, side * random.uniform(29.6, 30.6));
    }
  }
  for (double y = -27.0; y < 28.0; y += random.uniform(3.5, 8.5)) {
    tree(random.uniform(38.0, 40.5), y);
    tree(random.uniform(-44.0, -41.0), y);
  }
}

void addHouses(LotLayout* layout) {
  layout->buildings = {{{-30.0, 32.0, -6.0, 44.0}, 9.5, "PARKHAUS NORD", 21},
                       {{-1.0, 33.0, 16.0, 45.0}, 6.5, "CAFE AM PLATZ", 22},
                       {{22.0, 31.0, 44.0, 43.0}, 12.0, "HOTEL STERN", 23},
                       {{42.0, -26.0, 54.0, -2.0}, 8.0, "ELEKTRO WEBER", 24},
                       {{43.0, 4.0, 56.0, 24.0}, 10.5, "BAUMARKT", 25},
                       {{-20.0, -46.0, 8.0, -33.0}, 7.5, "TECHNIKUM 4", 26},
                       {{15.0, -44.0, 33.0, -32.0}, 5.0, "WERKSTATT", 27},
                       {{-60.0, -20.0, -46.0, 12.0}, 11.0, "LABOR 7", 28}};
}

void addStreetFurniture(Random* random, LotLayout* layout) {
  const auto bin = [&](double x, double y, double yaw_rad) {
    layout->bins.push_back({x, y, layout->groundHeight(x, y), yaw_rad});
  };
  for (const double side : {-1.0, 1.0}) {
    for (double x = -27.0; x <= 28.0; x += 13.5) {
      layout->poles.push_back({x + random->uniform(-1.0, 1.0), side * 23.0, kKerbHeight_m, 5.5, 0.06, true});
    }
    for (double x = -16.0; x <= 17.0; x += 11.0) {
      layout->poles.push_back({x, side * 7.5, kKerbHeight_m, 1.2, 0.035, false});
    }
    layout->fences.push_back({-38.0, side * 28.6, 38.0, side * 28.6, kKerbHeight_m});
    for (const double middle_x : {-10.0, 10.0}) {
      const double x = random->uniform(middle_x - 5.0, middle_x + 5.0);
      bin(x, side * 23.2, random->uniform(0.0, 3.0));
    }
  }
  for (double y = -20.0; y <= 20.0; y += 2.5) {
    layout->poles.push_back({30.2, y, 0.0, 0.9, 0.06, false});  // bollards in front of the plaza
  }
  for (const double y : {-12.0, 6.5}) {
    bin(31.4, y, 0.3);
    layout->poles.push_back({31.0, y + 3.0, 0.0, 4.5, 0.06, true});
  }
}

}  // namespace

double LotLayout::groundHeight(double x, double y) const {
  for (const GroundRectangle& island : islands) {
    if (island.contains(x, y)) {
      return kerb.height_m;
    }
  }
  return 0.0;
}

LotLayout makeLotLayout(uint64_t seed, const Day& day, uint64_t layout_seed) {
  if (layout_seed != 0) {
    LotLayout layout = makeDrawnLot(LotPlan::fromSeed(layout_seed), layout_seed, seed);
    addWoods(seed, &layout);
    addHouses(&layout);
    layout.cars = parkCars(layout.bays, kOccupiedBays, seed, day);
    return layout;
  }
  LotLayout layout;
  Random random(seed);
  addPaving(&layout);
  addBays(&layout);
  addIslands(&layout);
  addPlants(&random, &layout);
  addWoods(seed, &layout);
  addHouses(&layout);
  addStreetFurniture(&random, &layout);
  layout.cars = parkCars(layout.bays, kOccupiedBays, seed, day);
  return layout;
}

}  // namespace vcharge
