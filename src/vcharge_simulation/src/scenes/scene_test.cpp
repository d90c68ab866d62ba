#include "vcharge_simulation/scenes/scene_catalogue.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <set>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "scenes/catalogue_cases.h"
#include "scenes/garage/garage_layout.h"
#include "scenes/lot/lot_layout.h"
#include "scenes/road/road_layout.h"
#include "scenes/scene_parts.h"
#include "vcharge_simulation/drive/drive_simulator.h"
#include "vcharge_simulation/drive/truth_maps.h"
#include "vcharge_simulation/objects/car_model.h"
#include "vcharge_simulation/sensors/golf_rig.h"

namespace vcharge {
namespace {

constexpr double kImageScale = 0.3;
constexpr double kCell_m = 0.1;

class SceneTest : public testing::TestWithParam<SceneCase> {
 protected:
  const Renderer& renderer() const { return rendererOf(GetParam().scene); }
};

std::string sceneOf(const testing::TestParamInfo<SceneCase>& info) {
  return info.param.scene;
}
INSTANTIATE_TEST_SUITE_P(Catalogue, SceneTest, testing::ValuesIn(kSceneCases), sceneOf);

TEST_P(SceneTest, SameBytesOnAnyNumberOfThreads) {
  const CameraView view(makeGolfRig(1, 0.15).cameras[1], makeGolfBody());
  const auto render = [&](size_t threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    const Moment moment = momentOf(GetParam());
    return renderer().renderLight(view, moment.world_from_vehicle, moment.time_s);
  };
  EXPECT_EQ(cv::norm(render(1), render(4), cv::NORM_INF), 0.0);
}

// Walls around the scene stand on its border.
TEST_P(SceneTest, WhatStandsOutOfTheGroundBelongsToAnObstacle) {
  const StandingCells cells =
      findStandingCells(renderer().scene(), computeHeightMap(renderer(), kCell_m, 2.4), 3);
  EXPECT_GT(cells.all, 10000);
  EXPECT_LT(cells.unexplained, cells.all / 100);
}

TEST_P(SceneTest, HeightMapHoldsCarsPillarsAndThings) {
  const Scene& scene = renderer().scene();
  const TruthHeightMap map = computeHeightMap(renderer(), kCell_m, 2.8);
  int seen = 0;
  for (const Obstacle& obstacle : scene.obstacles) {
    const Eigen::Vector2d cell = (middleOf(obstacle) - map.origin_m) / kCell_m;
    const bool is_solid = obstacle.kind == "car" || obstacle.kind == "box" || obstacle.kind == "trailer" ||
                          obstacle.kind == "bin" || obstacle.kind == "pedestrian";
    if (!is_solid || cell.minCoeff() < 1.0 || cell.x() > map.height_m.cols - 2 ||
        cell.y() > map.height_m.rows - 2) {
      continue;
    }
    const float height_m = map.height_m.at<float>(static_cast<int>(std::lround(cell.y())),
                                                  static_cast<int>(std::lround(cell.x())));
    EXPECT_GT(height_m, obstacle.base_z_m + 0.45 * (obstacle.top_z_m - obstacle.base_z_m)) << obstacle.kind;
    EXPECT_LT(height_m, obstacle.top_z_m + 0.05) << obstacle.kind;
    ++seen;
  }
  EXPECT_GT(seen, 20);
}

TEST(CatalogueTest, EveryDriveStaysInItsSceneAndLastsSomeSeconds) {
  constexpr double kFront_m = 3.5;  // length of the car ahead of its rear axle
  for (const CatalogueEntry& scene : listScenes()) {
    const Scene& area = rendererOf(scene.name).scene();
    for (const CatalogueEntry& entry : listDrives(scene.name)) {
      const DrivePlan plan = planDrive(scene.name, entry.name);
      const SimulatedDrive drive = simulateDrive(plan.path, plan.motion, WheelOdometerOptions(), 1, 1,
                                                 FaultOptions(), plan.ground_height);
      EXPECT_GT(drive.world_from_vehicle.size(), 50U) << scene.name << " " << entry.name;
      for (const auto& [stamp, world_from_vehicle] : drive.world_from_vehicle) {
        const Eigen::Vector2d position_m = world_from_vehicle.translation().head<2>();
        ASSERT_GT((position_m - area.min_m).minCoeff(), kFront_m) << scene.name << " " << entry.name;
        ASSERT_GT((area.max_m - position_m).minCoeff(), kFront_m) << scene.name << " " << entry.name;
      }
    }
  }
}

TEST_P(SceneTest, DrivesKeepClearOfAllThatStands) {
  for (const CatalogueEntry& entry : listDrives(GetParam().scene)) {
    const DrivePlan plan = planDrive(GetParam().scene, entry.name);
    std::vector<Obstacle> obstacles = renderer().scene().obstacles;
    if (plan.day != 0) {  // the cars are those of day 0
      obstacles.erase(std::remove_if(obstacles.begin(), obstacles.end(),
                                     [](const Obstacle& obstacle) { return obstacle.kind == "car"; }),
                      obstacles.end());
    }
    EXPECT_THAT(touchedOn(plan, obstacles), testing::IsEmpty()) << entry.name;
  }
}

// Scenes with different seeds and days differ, where the car drives, only in the parked cars.
TEST(CatalogueTest, DrivesKeepClearOfParkedCarsForEverySeedAndDay) {
  const std::map<std::string, std::function<std::vector<ParkedCar>(uint64_t, const Day&)>> scenes = {
      {"lot", [](uint64_t seed, const Day& day) { return makeLotLayout(seed, day).cars; }},
      {"garage", [](uint64_t seed, const Day& day) { return makeGarageLayout(seed, day).cars; }},
      {"road", [](uint64_t seed, const Day& day) { return makeRoadLayout(seed, day).cars; }}};
  for (const auto& [scene, carsOf] : scenes) {
    for (const CatalogueEntry& entry : listDrives(scene)) {
      const DrivePlan plan = planDrive(scene, entry.name);
      std::vector<Obstacle> cars;
      for (uint64_t seed = 1; seed <= 12; ++seed) {
        for (const Day& day : {Day(plan.day), Day(plan.day, 1.0)}) {
          for (const ParkedCar& car : carsOf(seed, day)) {
            cars.push_back(obstacleOf(car));
            cars.back().base_z_m = -1.0;
            cars.back().top_z_m = 5.0;
          }
        }
      }
      EXPECT_THAT(touchedOn(plan, cars), testing::IsEmpty()) << scene << " " << entry.name;
    }
  }
}

TEST(CatalogueTest, ADayExchangesTheWantedFractionOfTheCarsAndNothingElse) {
  const LotLayout before = makeLotLayout(1, 0);
  const auto same = [](const ParkedCar& a, const ParkedCar& b) {
    return a.x == b.x && a.y == b.y && a.yaw_rad == b.yaw_rad && a.shape == b.shape && a.paint == b.paint;
  };
  size_t kept_of_less = before.cars.size();
  for (const double fraction : {0.0, 0.2, 0.5, 1.0}) {
    const LotLayout after = makeLotLayout(1, Day(3, fraction));
    size_t kept = 0;
    for (const ParkedCar& car : before.cars) {
      kept += std::any_of(after.cars.begin(), after.cars.end(),
                          [&](const ParkedCar& other) { return same(car, other); })
                  ? 1
                  : 0;
    }
    const double expected = (1.0 - fraction) * static_cast<double>(before.cars.size());
    EXPECT_NEAR(kept, expected, 3.0 * std::sqrt(fraction * expected + 1e-9) + 1e-9) << fraction;
    EXPECT_LE(kept, kept_of_less);
    kept_of_less = kept;
    EXPECT_GT(after.cars.size(), before.cars.size() / 2);
    ASSERT_EQ(after.trees.size(), before.trees.size());
    for (size_t i = 0; i < after.trees.size(); ++i) {
      EXPECT_EQ(after.trees[i].x, before.trees[i].x);
    }
    EXPECT_EQ(after.poles.size(), before.poles.size());
  }
  EXPECT_FALSE(same(makeLotLayout(1, Day(1, 1.0)).cars[0], makeLotLayout(1, Day(2, 1.0)).cars[0]));
}

TEST(SlopeTest, ParkedCarsStandOnTheGroundWithAllFourWheels) {
  const Scene& scene = rendererOf("two_levels").scene();
  std::set<uint32_t> of_cars;
  for (const MeshTriangle& triangle : scene.mesh.triangles) {
    if (scene.materials[triangle.material].kind == SurfaceKind::kCar) {
      of_cars.insert(triangle.vertices.begin(), triangle.vertices.end());
    }
  }
  int cars = 0;
  for (const Obstacle& obstacle : scene.obstacles) {
    if (obstacle.kind != "car") {
      continue;
    }
    const Eigen::Vector2d middle = 0.5 * (obstacle.footprint_m[0] + obstacle.footprint_m[2]);
    const Eigen::Vector2d along = 0.5 * (obstacle.footprint_m[1] - obstacle.footprint_m[0]);
    const Eigen::Vector2d across = 0.5 * (obstacle.footprint_m[3] - obstacle.footprint_m[0]);
    // Lowest vertex in each quarter of the car, relative to the ground; it belongs to a tyre.
    std::map<std::pair<bool, bool>, double> lowest_m;
    for (const uint32_t index : of_cars) {
      const Eigen::Vector3d vertex = scene.mesh.vertices[index].position.cast<double>();
      const double x = (vertex.head<2>() - middle).dot(along) / along.squaredNorm();
      const double y = (vertex.head<2>() - middle).dot(across) / across.squaredNorm();
      if (std::abs(x) < 1.0 && std::abs(y) < 1.0) {
        const double height_m = vertex.z() - groundAt(scene, vertex.head<2>());
        const auto [found, is_new] = lowest_m.emplace(std::pair(x > 0.0, y > 0.0), height_m);
        found->second = std::min(found->second, height_m);
      }
    }
    ASSERT_EQ(lowest_m.size(), 4U);
    for (const auto& [quarter, height_m] : lowest_m) {
      EXPECT_NEAR(height_m, 0.0, 0.015);
    }
    ++cars;
  }
  EXPECT_GT(cars, 20);
}

TEST(MoverTest, ChangesTheRangeOnlyWhereItsFootprintsAre) {
  const Renderer& renderer = rendererOf("obstacles");
  const CameraView view(makeGolfRig(1, kImageScale).cameras[1], nullptr);
  const RigidTransform world_from_vehicle = RigidTransform::planar(1.0, 0.0, 0.0);
  const RigidTransform world_from_camera = world_from_vehicle * *view.camera().vehicle_from_camera;
  const Mover& walker = renderer.scene().movers.front();
  constexpr double kTimes_s[] = {10.0, 12.0};
  const cv::Mat ranges[] = {renderer.renderRange(view, world_from_vehicle, kTimes_s[0]),
                            renderer.renderRange(view, world_from_vehicle, kTimes_s[1])};
  int changed = 0;
  for (int y = 0; y < view.size().height; ++y) {
    for (int x = 0; x < view.size().width; ++x) {
      const float before_m = ranges[0].at<float>(y, x);
      const float after_m = ranges[1].at<float>(y, x);
      if (before_m == after_m || (std::isnan(before_m) && std::isnan(after_m))) {
        continue;
      }
      // The walker is in the image with the smaller range.
      const bool is_before = std::isnan(after_m) || before_m < after_m;
      const double range_m = is_before ? before_m : after_m;
      const Eigen::Vector3d position = world_from_camera * (range_m * view.centreRay(x, y).cast<double>());
      const MoverState state = walker.stateAt(kTimes_s[is_before ? 0 : 1]);
      const double reach_m = (position - state.world_from_mover.translation()).head<2>().norm();
      EXPECT_LT(reach_m, 0.75);  // half a stride
      EXPECT_LT(position.z(), state.obstacle.top_z_m + 0.05);
      ++changed;
    }
  }
  EXPECT_GT(changed, 200);
}

TEST(MoverTest, CameraSeesTheSquaresOfTheBoardWhereItsPoseSays) {
  const Renderer& renderer = rendererOf("chessboard");
  const DrivePlan plan = planDrive("chessboard", "board_left");
  const CameraView view(makeGolfRig(1, 1.0).cameras[1], nullptr);
  int poses = 0;
  for (int pose = 0; pose < 3; ++pose) {
    const double time_s = plan.start_s + pose + 0.1;
    const cv::Mat light = renderer.renderLight(view, plan.path.worldFromStart(), time_s);
    const RigidTransform camera_from_board =
        (plan.path.worldFromStart() * *view.camera().vehicle_from_camera).inverse() *
        renderer.scene().movers.front().stateAt(time_s).world_from_mover;
    double dark = 0.0;
    double bright = 0.0;
    for (int row = 0; row < 7; ++row) {
      for (int column = 0; column < 10; ++column) {
        // The origin of the board is its first inner corner.
        const Eigen::Vector3d middle(0.1 * column - 0.05, 0.1 * row - 0.05, 0.0);
        Eigen::Vector2d pixel;
        ASSERT_TRUE(view.camera().model.project(camera_from_board * middle, &pixel));
        const double value = light.at<float>(static_cast<int>(std::lround(pixel.y())),
                                             static_cast<int>(std::lround(pixel.x())));
        ((row + column) % 2 == 0 ? dark : bright) += value / 35.0;
      }
    }
    EXPECT_LT(dark, 0.35 * bright) << "pose " << pose;
    ++poses;
  }
  EXPECT_EQ(poses, 3);
}

}  // namespace
}  // namespace vcharge
