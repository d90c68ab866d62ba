#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "scenes/catalogue_cases.h"
#include "scenes/garage/garage_fittings.h"
#include "scenes/garage/garage_layout.h"
#include "scenes/lot/lot_ground.h"
#include "scenes/lot/lot_layout.h"
#include "scenes/movers/mover_planner.h"
#include "scenes/scene_parts.h"
#include "vcharge_simulation/drive/drive_simulator.h"
#include "vcharge_simulation/objects/car_model.h"

namespace vcharge {
namespace {

constexpr uint64_t kLayouts = 20;

// What stands on a drawn lot or in a drawn garage, without triangles and light, which take longer to make.
struct Outlines {
  MoverArea area;
  std::vector<Obstacle> obstacles;

  template <class Things>
  void add(const Things& things) {
    for (const auto& thing : things) {
      obstacles.push_back(obstacleOf(thing));
    }
  }
};

Outlines outlinesOfLot(const LotLayout& layout) {
  Outlines lot{{kLotArea, layout.lanes, baysToLeave(layout.bays)}, {}};
  for (const GroundRectangle& island : layout.islands) {
    lot.obstacles.push_back(obstacleOf(island, layout.kerb));
  }
  lot.add(layout.cars);
  lot.add(layout.trees);
  lot.add(layout.bushes);
  lot.add(layout.hedges);
  lot.add(layout.garden_walls);
  lot.add(layout.buildings);
  lot.add(layout.poles);
  lot.add(layout.bins);
  lot.add(layout.fences);
  return lot;
}

Outlines outlinesOfGarage(const GarageLayout& layout) {
  constexpr double kWall_m = 1.0;
  constexpr double kPipe_m = 0.15;  // a pipe may be on either side of a pillar
  const GroundRectangle& area = layout.plan.area;
  Outlines garage{{area, layout.plan.lanes, layout.bays}, {}};
  for (const GroundRectangle& wall :
       {GroundRectangle{area.min_x - kWall_m, area.min_y, area.min_x, area.max_y},
        GroundRectangle{area.max_x, area.min_y, area.max_x + kWall_m, area.max_y},
        GroundRectangle{area.min_x, area.min_y - kWall_m, area.max_x, area.min_y},
        GroundRectangle{area.min_x, area.max_y, area.max_x, area.max_y + kWall_m}}) {
    garage.obstacles.push_back({"wall", cornersOf(wall), 0.0, layout.plan.height_m});
  }
  garage.add(layout.cars);
  const double half_m = 0.5 * layout.plan.pillar_width_m;
  for (const GarageLayout::Pillar& pillar : layout.pillars) {
    garage.obstacles.push_back(
        {"pillar", orientedRectangle(pillar.x, pillar.y, 0.0, -half_m - kPipe_m, half_m + kPipe_m, half_m),
         0.0, layout.plan.height_m});
  }
  return garage;
}

class LayoutTest : public testing::TestWithParam<std::string> {
 protected:
  static Outlines outlinesOf(uint64_t layout_seed, const Day& day) {
    return GetParam() == "lot" ? outlinesOfLot(makeLotLayout(layout_seed, day, layout_seed))
                               : outlinesOfGarage(makeGarageLayout(layout_seed, day, layout_seed));
  }
};
std::string sceneOf(const testing::TestParamInfo<std::string>& info) {
  return info.param;
}
INSTANTIATE_TEST_SUITE_P(Scenes, LayoutTest, testing::Values("lot", "garage"), sceneOf);

TEST_P(LayoutTest, DrivesKeepClearOfAllThatStandsInEveryDrawnLayout) {
  for (uint64_t layout_seed = 1; layout_seed <= kLayouts; ++layout_seed) {
    // Any drive may be driven on any day.
    std::vector<Obstacle> obstacles = outlinesOf(layout_seed, 0).obstacles;
    for (const Obstacle& obstacle : outlinesOf(layout_seed, Day(1, 1.0)).obstacles) {
      if (obstacle.kind == "car") {
        obstacles.push_back(obstacle);
      }
    }
    for (const CatalogueEntry& entry : listDrives(GetParam())) {
      EXPECT_THAT(touchedOn(planDrive(GetParam(), entry.name, layout_seed), obstacles), testing::IsEmpty())
          << entry.name << ", layout " << layout_seed;
    }
  }
}

TEST_P(LayoutTest, MoversFindTheirWaysInEveryDrawnLayout) {
  MoverOptions movers;
  movers.people = 2;
  movers.children = 1;
  movers.cars = 2;
  movers.bicycles = 1;
  for (uint64_t layout_seed = 1; layout_seed <= kLayouts; ++layout_seed) {
    const DrivePlan plan = planDrive(GetParam(), "stop_and_go", layout_seed);
    const OwnCar own_car(ownPoses(simulateDrive(plan.path, plan.motion, WheelOdometerOptions(), 1, 1,
                                                FaultOptions(), plan.ground_height)));
    const Outlines outlines = outlinesOf(layout_seed, 0);
    Scene scene;
    scene.obstacles = outlines.obstacles;
    EXPECT_EQ(planMovers(movers, outlines.area, scene, own_car, 0.0).size(), 6U) << "layout " << layout_seed;
  }
}

TEST_P(LayoutTest, ADrawnSceneHoldsWhatItsLayoutNames) {
  SceneOptions options;
  options.seed = options.layout_seed = 3;
  options.image_scale = 0.02;
  options.detail = 0.1;
  const std::shared_ptr<const Scene> scene = buildScene(GetParam(), options);
  const auto positions = [](const std::vector<Obstacle>& obstacles) {
    std::vector<std::string> found;
    for (const Obstacle& obstacle : obstacles) {
      // Walls of the garage are its border; pipes and stops stand at pillars and in bays.
      if (obstacle.kind != "pipe" && obstacle.kind != "wheel_stop" &&
          (GetParam() == "lot" || obstacle.kind != "wall")) {
        const Eigen::Vector2d middle_mm = (1e3 * middleOf(obstacle)).array().round();
        found.push_back(obstacle.kind + " " + std::to_string(middle_mm.x()) + " " +
                        std::to_string(middle_mm.y()));
      }
    }
    return found;
  };
  EXPECT_THAT(positions(scene->obstacles),
              testing::UnorderedElementsAreArray(positions(outlinesOf(3, 0).obstacles)));
  for (const CatalogueEntry& entry : listDrives(GetParam())) {
    const DrivePlan plan = planDrive(GetParam(), entry.name, 3);
    EXPECT_THAT(touchedOn(plan, scene->obstacles), testing::IsEmpty()) << entry.name;
  }
}

TEST_P(LayoutTest, PaintedBaysTouchTheirNeighboursAndHoldTheParkedCars) {
  for (uint64_t layout_seed = 1; layout_seed <= kLayouts; ++layout_seed) {
    std::vector<PlannedBay> planned;
    std::vector<ParkedCar> cars;
    if (GetParam() == "lot") {
      const LotLayout layout = makeLotLayout(3, {}, layout_seed);
      planned = layout.bays;
      cars = layout.cars;
    } else {
      const GarageLayout layout = makeGarageLayout(3, {}, layout_seed);
      planned = layout.bays;
      cars = layout.cars;
    }
    const std::vector<ParkingBay> bays = paintedBays(planned, cars);
    ASSERT_EQ(bays.size(), planned.size());
    size_t num_occupied = 0;
    for (size_t i = 0; i < bays.size(); ++i) {
      num_occupied += bays[i].state == BayState::kOccupied ? 1 : 0;
      const auto& c = bays[i].corners_m;
      for (size_t k = 0; k < c.size(); ++k) {
        const Eigen::Vector2d side = c[(k + 1) % 4] - c[k], next = c[(k + 2) % 4] - c[(k + 1) % 4];
        EXPECT_GT(side.x() * next.y() - side.y() * next.x(), 0.0) << "counter-clockwise";
      }
      if (i > 0 && bays[i].row == bays[i - 1].row &&
          (bays[i].centre_m() - bays[i - 1].centre_m()).norm() < 3.5) {
        // Lines between bays are painted once.
        const auto& p = bays[i - 1].corners_m;
        EXPECT_LT(std::min((c[0] - p[1]).norm() + (c[3] - p[2]).norm(),
                           (c[1] - p[0]).norm() + (c[2] - p[3]).norm()),
                  1e-6);
      }
    }
    EXPECT_EQ(num_occupied, cars.size()) << "layout " << layout_seed;
  }
}

TEST(GarageFittingsTest, HaveNormalsUnderLowCeilingsToo) {
  int num_low = 0;
  for (uint64_t layout_seed = 1; layout_seed <= 3 * kLayouts; ++layout_seed) {
    const GarageLayout layout = makeGarageLayout(3, {}, layout_seed);
    SceneParts parts(5, 1.0);
    addGarageFittings(layout, &parts);
    num_low += layout.plan.height_m < 2.2 ? 1 : 0;
    for (const MeshVertex& vertex : parts.scene().mesh.vertices) {
      ASSERT_TRUE(vertex.position.allFinite() && vertex.normal.allFinite()) << "layout " << layout_seed;
    }
  }
  EXPECT_GT(num_low, 0);
}

TEST(LayoutSeedTest, IsRefusedByScenesWithOneLayout) {
  EXPECT_THROW(planDrive("road", "bumps", 1), std::invalid_argument);
}

}  // namespace
}  // namespace vcharge
