#include "scenes/lot/drawn_lot.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "vcharge_simulation/rendering/noise.h"

namespace vcharge {

namespace {

constexpr double kHalfPi = 1.57079632679489661923;
constexpr double kEdge_m = 29.0;   // half the extent across the lanes
constexpr double kEdgeX_m = 39.0;  // half the extent along them
constexpr double kLarge_m = 1e3;

class LotDrawer {
 public:
  LotDrawer(const LotPlan& plan, uint64_t layout_seed, uint64_t seed)
      : plan_(plan), random_(layout_seed * 3343U + seed * 17U) {
    layout_.lanes = plan.lanes;
    Random kerbs(layout_seed * 613U + 5U);
    layout_.kerb.height_m = kerbs.uniform(0.03, 0.15);
    layout_.kerb.is_bevelled = kerbs.chance(0.5);
  }

  LotLayout draw() {
    const double middle_m = plan_.half_middle_aisle_m + 0.5 * plan_.depthOf(plan_.middle_bays);
    const double outer_m = plan_.lanes.y_m + plan_.half_outer_aisle_m + 0.5 * kBayLength_m;
    for (const double side : {-1.0, 1.0}) {
      const bool is_north = side > 0.0;
      addRow(side * middle_m, side, plan_.middle_bays, true);
      const BayKind inner = is_north ? plan_.north_bays : BayKind::kPerpendicular;
      addRow(side * (innerBorder() + 0.5 * plan_.depthOf(inner)), -side, inner, is_north);
      if (plan_.has_outer_rows[is_north ? 1 : 0]) {
        addRow(side * outer_m, side, BayKind::kPerpendicular, false);
      }
      addMiddleIsland(side);
      addBorder(side);
    }
    for (const double side : {-1.0, 1.0}) {
      addEnds(side);
    }
    pave();
    addFurniture();
    return layout_;
  }

 private:
  // Outer edge of the island between the rows of a double row.
  double innerBorder() const {
    return plan_.half_middle_aisle_m + plan_.depthOf(plan_.middle_bays) + 2.0 * plan_.half_island_m;
  }
  // Where the ground behind the outer row or behind the outer lane begins.
  double border(double side) const {
    return plan_.lanes.y_m + plan_.half_outer_aisle_m + kBayLength_m +
           (plan_.has_outer_rows[side > 0.0 ? 1 : 0] ? 0.3 : 0.3 - (side > 0.0 ? 0.8 * kBayLength_m : 0.0));
  }

  void addIsland(double min_x, double min_y, double max_x, double max_y) {
    layout_.islands.push_back({min_x, std::min(min_y, max_y), max_x, std::max(min_y, max_y)});
  }

  // Bays along y, open towards -`into`. Some of them may be islands with a tree.
  void addRow(double y, double into, BayKind kind, bool may_have_trees) {
    const double half_m = plan_.rowHalf();
    double yaw_rad = into * kHalfPi;
    double spacing_m = kBayWidth_m;
    double inset_m = 0.0;
    if (kind == BayKind::kAngled) {
      yaw_rad = into * plan_.bay_angle_rad;
      spacing_m = kBayWidth_m / std::sin(plan_.bay_angle_rad);
      inset_m = 0.5 * kBayLength_m * std::cos(plan_.bay_angle_rad);
    } else if (kind == BayKind::kParallel) {
      yaw_rad = into > 0.0 ? 0.0 : 2.0 * kHalfPi;
      spacing_m = kParallelLength_m;
    }
    const int count = static_cast<int>(2.0 * (half_m - inset_m) / spacing_m + 1e-6);
    const int tree_every = may_have_trees && random_.chance(0.5) ? 4 + random_.index(3) : 1000;
    for (int i = 0; i < count; ++i) {
      const double x = (i + 0.5 - 0.5 * count) * spacing_m;
      if (i % tree_every == tree_every - 1 && kind != BayKind::kAngled) {
        const double half_depth = 0.5 * plan_.depthOf(kind) - 0.15;
        addIsland(x - 0.5 * spacing_m + 0.1, y - half_depth, x + 0.5 * spacing_m - 0.1, y + half_depth);
        tree(x, y, 0.55, 0.8);
        continue;
      }
      const bool keep_free = y < -plan_.half_middle_aisle_m && into > 0.0 &&
                             std::abs(x - plan_.free_bay_x_m) < 0.5 * kBayWidth_m;
      layout_.bays.push_back({x, y, yaw_rad, number_++, keep_free, kind, into > 0.0});
    }
  }

  void tree(double x, double y, double low, double high) {
    layout_.trees.push_back({x, y, layout_.groundHeight(x, y), random_.uniform(low, high),
                             random_.uniform(0.0, 6.28), random_.index(kNumSmallTrees)});
  }
  void bush(double x, double y, double low, double high) {
    const double radius = random_.uniform(low, high);
    layout_.bushes.push_back({x, y, layout_.groundHeight(x, y), radius, radius * random_.uniform(1.0, 1.7),
                              static_cast<uint32_t>(random_.bits())});
  }

  void addMiddleIsland(double side) {
    const double middle = innerBorder() - plan_.half_island_m;
    const double half = plan_.half_island_m;
    const double end = plan_.rowHalf() - 0.1;
    const int kind = random_.index(4);
    if (kind == 0 && half > 0.3) {
      layout_.garden_walls.push_back(
          {{-end, side * middle - 0.12, end, side * middle + 0.12}, random_.uniform(0.5, 1.6)});
      return;
    }
    addIsland(-end, side * (middle - half), end, side * (middle + half));
    if (kind == 1) {
      layout_.hedges.push_back({{-end + 0.4, side * middle - 0.18, end - 0.4, side * middle + 0.18},
                                layout_.kerb.height_m,
                                random_.uniform(0.5, 1.1)});
    } else if (kind == 2 && half > 0.45) {
      for (double x = -end + 1.5; x < end - 1.0; x += random_.uniform(5.0, 9.0)) {
        tree(x, side * middle, 0.6, 0.9);
      }
    }
  }

  // Islands at the ends of the double rows, and the ground beyond the crossing lanes.
  void addEnds(double end) {
    const double near_x = plan_.rowHalf() + 0.1;
    for (const double side : {-1.0, 1.0}) {
      const double from = side * (plan_.half_middle_aisle_m + 0.1);
      const double to = side * (plan_.lanes.y_m - 2.9);
      addIsland(std::min(end * near_x, end * (near_x + 2.0)), from,
                std::max(end * near_x, end * (near_x + 2.0)), to);
      if (random_.chance(0.7)) {
        tree(end * (near_x + 1.0), 0.5 * (from + to) + random_.uniform(-1.0, 1.0), 0.65, 0.9);
      }
      if (random_.chance(0.7)) {
        bush(end * (near_x + 1.0), from + side * 1.3, 0.45, 0.7);
      }
    }
    const double beyond = plan_.lanes.x_m + plan_.beyond_x_m;
    const double low_y = -border(-1.0) + 0.01;
    const double high_y = border(1.0) - 0.01;
    if (random_.chance(0.4)) {
      layout_.garden_walls.push_back({{std::min(end * beyond, end * (beyond + 0.25)), low_y,
                                       std::max(end * beyond, end * (beyond + 0.25)), high_y},
                                      random_.uniform(0.8, 2.4)});
      return;
    }
    addIsland(std::min(end * beyond, end * kEdgeX_m), low_y, std::max(end * beyond, end * kEdgeX_m), high_y);
    for (double y = low_y + 2.0; y < high_y - 2.0; y += random_.uniform(3.0, 8.0)) {
      tree(end * random_.uniform(beyond + 2.2, beyond + 5.5), y, 0.7, 1.2);
      bush(end * random_.uniform(beyond + 1.2, beyond + 1.6), y + 1.2, 0.4, 0.9);
    }
  }

  void addBorder(double side) {
    const double near = border(side);
    const int kind = random_.index(3);
    if (kind == 0) {
      layout_.garden_walls.push_back({{-kEdgeX_m + 1.0, std::min(side * near, side * (near + 0.25)),
                                       kEdgeX_m - 1.0, std::max(side * near, side * (near + 0.25))},
                                      random_.uniform(0.8, 2.6)});
      return;
    }
    addIsland(-kEdgeX_m, side * near, kEdgeX_m, side * kEdge_m);
    if (kind == 1) {
      layout_.fences.push_back(
          {-kEdgeX_m + 1.0, side * (near + 0.6), kEdgeX_m - 1.0, side * (near + 0.6), layout_.kerb.height_m});
    }
    for (double x = -36.0; x < 37.0; x += random_.uniform(2.5, 8.0)) {
      const double y = random_.uniform(near + 1.9, std::max(near + 2.0, kEdge_m - 1.0));
      if (random_.chance(0.6)) {
        tree(x, side * y, 0.6, 1.2);
      } else {
        bush(x, side * y, 0.4, 0.9);
      }
    }
  }

  void pave() {
    const auto any = [&] {
      static constexpr std::array<Paving, 6> kKinds = {Paving::kAsphalt, Paving::kAsphalt, Paving::kAsphalt,
                                                       Paving::kCobbles, Paving::kBricks,  Paving::kSlabs};
      return kKinds[static_cast<size_t>(random_.index(6))];
    };
    const auto band = [&](double low, double high, Paving paving) {
      layout_.paving.push_back(
          {-kLarge_m, static_cast<float>(low), kLarge_m, static_cast<float>(high), paving});
    };
    const double row = plan_.half_middle_aisle_m;
    const double outer = plan_.lanes.y_m - 2.9;
    const double beyond = plan_.lanes.y_m + plan_.half_outer_aisle_m;
    band(-row, row, any());
    const Paving lanes = any();
    const Paving bays = any();
    for (const double side : {-1.0, 1.0}) {
      band(std::min(side * outer, side * beyond), std::max(side * outer, side * beyond), lanes);
      band(std::min(side * row, side * outer), std::max(side * row, side * outer), bays);
      band(std::min(side * beyond, side * kLarge_m), std::max(side * beyond, side * kLarge_m), bays);
    }
  }

  void addFurniture() {
    for (const double side : {-1.0, 1.0}) {
      for (double x = -plan_.lanes.x_m; x <= plan_.lanes.x_m; x += random_.uniform(8.0, 16.0)) {
        const double y = side * (border(side) + 0.9);
        const double z = layout_.groundHeight(x, y);
        layout_.poles.push_back({x, y, z, 5.5, 0.06, true});
        if (random_.chance(0.3)) {
          layout_.bins.push_back({x + 2.0, y, z, random_.uniform(0.0, 3.0)});
        }
      }
    }
  }

  const LotPlan plan_;
  Random random_;
  LotLayout layout_;
  int number_ = 1;
};

}  // namespace

LotLayout makeDrawnLot(const LotPlan& plan, uint64_t layout_seed, uint64_t seed) {
  return LotDrawer(plan, layout_seed, seed).draw();
}

}  // namespace vcharge
