#include "scenes/catalogue_cases.h"
#include "scenes/scene_builders.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <string>

#include <gtest/gtest.h>

namespace vcharge {
namespace {

constexpr double kCell_m = 0.1;

SceneOptions coarseLot(int day) {
  SceneOptions options;
  options.day = day;
  options.image_scale = 0.0625;
  options.detail = 0.1;
  return options;
}

const Renderer& lot() {
  static const Renderer renderer(buildLotScene(coarseLot(0)));
  return renderer;
}

const TruthHeightMap& heightMap() {
  static const TruthHeightMap map = computeHeightMap(lot(), kCell_m, 2.5);
  return map;
}

float heightAt(double x, double y) {
  const TruthHeightMap& map = heightMap();
  return map.height_m.at<float>(static_cast<int>(std::lround((y - map.origin_m.y()) / map.cell_size_m)),
                                static_cast<int>(std::lround((x - map.origin_m.x()) / map.cell_size_m)));
}

TEST(LotSceneTest, LanesAreLevelAndFree) {
  for (const double x : {-24.0, -10.0, 0.0, 12.0, 24.0}) {
    for (const double y : {-15.0, 0.0, 15.0}) {
      EXPECT_NEAR(heightAt(x, y), 0.0, 1e-4) << x << ", " << y;
    }
  }
}

TEST(LotSceneTest, HeightMapHoldsEveryObstacleAtItsHeight) {
  std::map<std::string, int> seen;
  for (const Obstacle& obstacle : lot().scene().obstacles) {
    const Eigen::Vector2d middle = middleOf(obstacle);
    if (middle.cwiseAbs().x() > 39.0 || middle.cwiseAbs().y() > 29.0) {
      continue;
    }
    const float height_m = heightAt(middle.x(), middle.y());
    if (obstacle.kind == "car") {
      // The roof above the middle of the cabin, or the bonnet.
      EXPECT_GT(height_m, 0.5 * obstacle.top_z_m);
      EXPECT_LT(height_m, obstacle.top_z_m + 0.02);
    } else if (obstacle.kind == "bin" || obstacle.kind == "hedge") {
      EXPECT_NEAR(height_m, obstacle.top_z_m, 0.25) << obstacle.kind;
    } else if (obstacle.kind == "kerb") {
      // A hedge may stand in the middle of an island.
      EXPECT_GE(height_m, obstacle.top_z_m - 1e-4);
    }
    ++seen[obstacle.kind];
  }
  for (const char* kind : {"car", "kerb", "tree", "bush", "hedge", "pole", "bin"}) {
    EXPECT_GT(seen[kind], 0) << kind;
  }
}

TEST(LotSceneTest, WhatStandsOutOfTheGroundBelongsToAnObstacle) {
  const StandingCells cells = findStandingCells(lot().scene(), heightMap());
  EXPECT_GT(cells.all, 20000);
  EXPECT_LT(cells.unexplained, cells.all / 200);
}

TEST(LotSceneTest, OnAnotherDaySomeCarsHaveMovedAndAllElseStands) {
  const auto positions = [](const Scene& scene, const std::string& kind) {
    std::set<std::pair<int, int>> result;
    for (const Obstacle& obstacle : scene.obstacles) {
      if (obstacle.kind == kind) {
        const Eigen::Vector2d middle = middleOf(obstacle);
        result.emplace(static_cast<int>(std::lround(middle.x() * 1000.0)),
                       static_cast<int>(std::lround(middle.y() * 1000.0)));
      }
    }
    return result;
  };
  const std::shared_ptr<const Scene> other_day = buildLotScene(coarseLot(1));
  for (const char* kind : {"tree", "bush", "hedge", "kerb", "pole", "building", "fence", "bin"}) {
    EXPECT_EQ(positions(lot().scene(), kind), positions(*other_day, kind)) << kind;
  }
  const auto before = positions(lot().scene(), "car");
  const auto after = positions(*other_day, "car");
  int kept = 0;
  for (const auto& position : before) {
    kept += static_cast<int>(after.count(position));
  }
  const double fraction = static_cast<double>(kept) / static_cast<double>(before.size());
  EXPECT_GT(fraction, 0.55);  // 30 % of the bays are redrawn at random
  EXPECT_LT(fraction, 0.85);
  EXPECT_GT((lot().scene().sky->directionToSun() - other_day->sky->directionToSun()).norm(), 0.3F);
}

}  // namespace
}  // namespace vcharge
