#include "vcharge_obstacles/local_obstacle_map.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "detection/box_world.h"
#include "fusion/obstacle_map_cells.h"
#include "vcharge_obstacles/map_scan.h"

namespace vcharge {
namespace {

/// Drives a rig straight along x through a world and fuses its range maps.
class LocalObstacleMapTest : public ::testing::Test {
 protected:
  LocalObstacleMapTest() : grid_(detector_options_.grid) {
    for (const RigCamera& camera : rig_.cameras) {
      const RangeMap map = measureBoxWorld({}, camera, {}, Timestamp());
      detectors_.emplace_back(rebuildWorkingCamera(map.camera, map.range_m.size(), camera),
                              *camera.vehicle_from_camera, VehicleFootprint().outline(), detector_options_);
    }
  }

  /// Adds one observation of all cameras from x, 80 ms after the previous one.
  void observe(const BoxWorld& world, double x_m, const BoxWorldNoise& noise = {0.01, 0.1, 1},
               bool is_at_rest = false) {
    stamp_ = stamp_ + durationFromSeconds(0.08);
    pose_ = RigidTransform::planar(x_m, 0.0, 0.0);
    map_.moveTo(stamp_, pose_);
    for (size_t i = 0; i < detectors_.size(); ++i) {
      BoxWorldNoise own = noise;
      own.seed = static_cast<uint32_t>(1000 * i) + static_cast<uint32_t>(stamp_.nanoseconds() / 80000000);
      map_.add(detectors_[i].detect(measureBoxWorld(world, rig_.cameras[i], pose_, stamp_, own)), grid_,
               pose_, is_at_rest);
    }
  }
  void drive(const BoxWorld& world, double from_m, double to_m, double step_m = 0.1) {
    for (double x = from_m; x <= to_m + 1e-9; x += step_m) {
      observe(world, x);
    }
  }
  void rest(const BoxWorld& world, int num_maps, const BoxWorldNoise& noise = {0.01, 0.1, 1}) {
    for (int i = 0; i < num_maps; ++i) {
      observe(world, pose_.translation().x(), noise, true);
    }
  }
  /// Number of cells of a state in a map that did not have it in an earlier map at the same pose.
  static int countNew(const ObstacleMap& before, const ObstacleMap& after, int8_t state) {
    return cv::countNonZero((after.state == state) & (before.state != state));
  }
  int8_t stateAt(double x_m, double y_m) const { return stateIn(map_.snapshot(), x_m, y_m); }

  const CameraRig rig_ = makeBoxWorldRig();
  ObstacleDetectorOptions detector_options_;
  PolarGrid grid_;
  std::vector<ObstacleDetector> detectors_;
  LocalObstacleMap map_;
  Timestamp stamp_;
  RigidTransform pose_;
};

const BoxWorld kPerson{{{{1.7, 2.8, 0.0}, {2.1, 3.2, 1.7}}}};

TEST_F(LocalObstacleMapTest, KeepsFreeOccupiedAndUnobservedApart) {
  drive(kPerson, 0.0, 0.8);
  EXPECT_EQ(stateAt(1.9, 2.85), kCellOccupied);
  EXPECT_EQ(stateAt(1.9, 2.2), kCellFree);
  EXPECT_EQ(stateAt(1.9, 3.3), kCellUnobserved);   // hidden behind
  EXPECT_EQ(stateAt(1.0, 0.0), kCellUnobserved);   // under the vehicle
  EXPECT_EQ(stateAt(-8.0, 0.0), kCellUnobserved);  // behind it
  const ObstacleMap map = map_.snapshot();
  for (int row = 0; row < map.state.rows; ++row) {
    for (int column = 0; column < map.state.cols; ++column) {
      const bool occupied = map.state.at<int8_t>(row, column) == kCellOccupied;
      EXPECT_EQ(std::isfinite(map.height_m.at<float>(row, column)), occupied);
      EXPECT_EQ(std::isfinite(map.point_m.at<cv::Vec2f>(row, column)[0]), occupied);
    }
  }
}

TEST_F(LocalObstacleMapTest, ScanReportsThePersonWithinItsSigmas) {
  drive(kPerson, 0.0, 0.8);
  const ObstacleScan scan = makeScan(map_.snapshot(), 360);
  // Towards the near side of the person, from (0.8, 0).
  const double angle_rad = std::atan2(2.8, 1.9 - 0.8);
  const auto ray =
      static_cast<size_t>(std::lround((angle_rad - scan.angle_min_rad) / scan.angle_increment_rad));
  const double expected_m = 2.8 / std::sin(scan.angle_rad(ray));
  EXPECT_NEAR(scan.range_m[ray], expected_m, 0.06);
  EXPECT_NEAR(scan.range_m[ray], expected_m, 3.0 * scan.range_sigma_m[ray]);
  EXPECT_GT(scan.height_m[ray], 0.8F);
}

TEST_F(LocalObstacleMapTest, PersonWhoLeftIsClearedWithinASecond) {
  drive(kPerson, 0.0, 0.8);
  ASSERT_EQ(stateAt(1.9, 2.85), kCellOccupied);
  drive({}, 0.9, 0.9 + 11 * 0.1);  // 12 observations: 0.96 s
  EXPECT_EQ(stateAt(1.9, 2.85), kCellFree);
  EXPECT_EQ(stateAt(1.9, 2.95), kCellFree);
}

TEST_F(LocalObstacleMapTest, StandingKeepsStatesAndTheirAgeGrows) {
  drive(kPerson, 0.0, 0.8);
  const ObstacleMap before = map_.snapshot();
  map_.moveTo(stamp_ + durationFromSeconds(600.0), pose_);
  const ObstacleMap after = map_.snapshot();
  EXPECT_EQ(cv::countNonZero(before.state != after.state), 0);
  double youngest = 0.0;
  cv::minMaxLoc(after.age_s, &youngest, nullptr, nullptr, nullptr, after.age_s == after.age_s);
  EXPECT_GE(youngest, 600.0);
}

TEST_F(LocalObstacleMapTest, UnobservedCellsDecayAndAreNeverFreed) {
  drive(kPerson, 0.0, 0.8);
  const ObstacleMap before = map_.snapshot();
  // Drives 6 m without observations; the person is still within the map.
  for (int i = 1; i <= 60; ++i) {
    map_.moveTo(stamp_, RigidTransform::planar(0.8 + 0.1 * i, 0.0, 0.0));
  }
  const ObstacleMap after = map_.snapshot();
  EXPECT_EQ(stateIn(before, 1.9, 2.2), kCellFree);
  EXPECT_EQ(stateIn(after, 1.9, 2.2), kCellUnobserved);
  EXPECT_GT(countCells(before, kCellFree), 500);
  EXPECT_EQ(countCells(after, kCellFree), 0);
}

TEST_F(LocalObstacleMapTest, UnknownRangesFreeNothingAndLetFreeCellsDecay) {
  drive({}, 0.0, 0.8);
  const ObstacleMap before = map_.snapshot();
  for (double x = 0.9; x < 1.7; x += 0.1) {
    observe({}, x, {0.01, 1.0, 1});  // no range at all, as at night
    const ObstacleMap now = map_.snapshot();
    EXPECT_LE(countCells(now, kCellFree), countCells(before, kCellFree));
    EXPECT_EQ(countCells(now, kCellOccupied), 0);
  }
  EXPECT_EQ(stateAt(1.9, 2.2), kCellUnobserved);
}

TEST_F(LocalObstacleMapTest, PersonEnteringFreeGroundMakesItNotFree) {
  drive({}, 0.0, 0.8);
  ASSERT_EQ(stateAt(1.9, 3.0), kCellFree);
  drive(kPerson, 0.9, 1.2);
  EXPECT_NE(stateAt(1.9, 2.85), kCellFree);
  EXPECT_NE(stateAt(1.9, 3.05), kCellFree);
  EXPECT_NE(stateAt(1.9, 3.3), kCellFree);  // hidden behind
}

TEST_F(LocalObstacleMapTest, ChangedGroundIsResetAtOnceAndHeld) {
  drive({}, 0.0, 0.8);
  ASSERT_EQ(stateAt(1.9, 3.0), kCellFree);
  ASSERT_EQ(stateAt(1.9, 2.7), kCellFree);
  // The range map still shows bare ground, as if windows matched the ground beside a foot.
  const auto observeChange = [&](double x_m, bool changed) {
    stamp_ = stamp_ + durationFromSeconds(0.08);
    const RigidTransform pose = RigidTransform::planar(x_m, 0.0, 0.0);
    map_.moveTo(stamp_, pose);
    CameraObstacles seen = detectors_[1].detect(measureBoxWorld({}, rig_.cameras[1], pose, stamp_));
    const Eigen::Vector2d offset = Eigen::Vector2d(1.9 - x_m, 3.0) - seen.origin_m;
    seen.changed_fraction.assign(grid_.size(), 0.0F);
    for (int side = -2; side <= 2 && changed; ++side) {
      const int ray = grid_.wrap(grid_.rayOf(std::atan2(offset.y(), offset.x())) + side);
      const int bin = grid_.binOfInverse(static_cast<float>(1.0 / offset.norm()));
      seen.changed_fraction[grid_.index(ray, bin)] = seen.changed_fraction[grid_.index(ray, bin + 1)] = 1.0F;
    }
    map_.add(seen, grid_, pose);
  };
  observeChange(0.9, true);
  EXPECT_EQ(stateAt(1.9, 3.0), kCellUnobserved);
  EXPECT_EQ(stateAt(1.9, 2.7), kCellUnobserved);  // within the margin
  EXPECT_EQ(stateAt(1.9, 2.2), kCellFree);
  for (int i = 1; i <= 3; ++i) {
    observeChange(0.9 + 0.1 * i, false);
    EXPECT_EQ(stateAt(1.9, 3.0), kCellUnobserved);
  }
  for (int i = 4; i <= 10; ++i) {
    observeChange(0.9 + 0.1 * i, false);
  }
  EXPECT_EQ(stateAt(1.9, 3.0), kCellFree);  // within a second
}

TEST_F(LocalObstacleMapTest, ScrollingKeepsPositionsInTheFixedFrame) {
  const BoxWorld world{{{{4.0, 3.0, 0.0}, {4.4, 3.4, 1.0}}}};
  drive(world, 0.0, 3.3);  // crosses many cells
  EXPECT_EQ(stateAt(4.2, 3.05), kCellOccupied);
  EXPECT_NE(stateAt(3.5, 3.05), kCellOccupied);
  map_.moveTo(stamp_, RigidTransform::planar(100.0, 0.0, 0.0));
  EXPECT_EQ(countCells(map_.snapshot(), kCellUnobserved),
            map_.snapshot().state.rows * map_.snapshot().state.cols);
}

TEST_F(LocalObstacleMapTest, ReanchoringMovesObstaclesWithTheirFrame) {
  drive(kPerson, 0.0, 0.8);
  const int occupied = countCells(map_.snapshot(), kCellOccupied);
  const RigidTransform moved = RigidTransform::planar(0.53, -1.27, 0.2);
  map_.reanchor(moved);
  const ObstacleMap map = map_.snapshot();
  const Eigen::Vector3d person = moved * Eigen::Vector3d(1.9, 2.85, 0.0);
  bool found = false;  // in the person's cell or a neighbour
  for (const double x : {-0.1, 0.0, 0.1}) {
    for (const double y : {-0.1, 0.0, 0.1}) {
      found = found || stateIn(map, person.x() + x, person.y() + y) == kCellOccupied;
    }
  }
  EXPECT_TRUE(found);
  const Eigen::Vector3d free = moved * Eigen::Vector3d(1.9, 2.2, 0.0);
  EXPECT_EQ(stateIn(map, free.x(), free.y()), kCellFree);
  EXPECT_GE(countCells(map, kCellOccupied), occupied / 2);
  EXPECT_LE(countCells(map, kCellOccupied), occupied);
  EXPECT_NEAR((map.fixed_from_vehicle.translation() - moved * Eigen::Vector3d(0.8, 0.0, 0.0)).norm(), 0.0,
              1e-9);
}

TEST_F(LocalObstacleMapTest, ObservationsFromTheSamePositionCountOnce) {
  observe(kPerson, 0.0);
  const ObstacleMap first = map_.snapshot();
  for (int i = 0; i < 50; ++i) {
    observe(kPerson, 0.0);
  }
  EXPECT_EQ(countCells(map_.snapshot(), kCellFree), countCells(first, kCellFree));
  EXPECT_EQ(countCells(map_.snapshot(), kCellOccupied), countCells(first, kCellOccupied));
}

TEST_F(LocalObstacleMapTest, AtRestObstaclesAreFoundAndNothingIsFreed) {
  rest(kPerson, 4);  // 0.32 s
  EXPECT_GT(countCells(map_.snapshot(), kCellOccupied), 0);
  rest(kPerson, 100);
  EXPECT_EQ(stateAt(1.9, 2.85), kCellOccupied);
  EXPECT_EQ(countCells(map_.snapshot(), kCellFree), 0);
}

TEST_F(LocalObstacleMapTest, AtRestWhatCameIsOccupiedAndWhatLeftBecomesUnobserved) {
  drive({}, 0.0, 0.8);
  rest({}, 50);
  ASSERT_EQ(stateAt(1.9, 2.85), kCellFree);
  rest(kPerson, 4);  // 0.32 s
  EXPECT_EQ(stateAt(1.9, 2.85), kCellOccupied);
  rest(kPerson, 100);
  rest({}, 4);
  EXPECT_EQ(stateAt(1.9, 2.85), kCellUnobserved);
  rest({}, 100);
  EXPECT_EQ(stateAt(1.9, 2.85), kCellUnobserved);
  drive({}, 0.9, 1.4);
  EXPECT_EQ(stateAt(1.9, 2.85), kCellFree);
}

TEST_F(LocalObstacleMapTest, AtRestNothingIsClearedThatWasOccupiedInMotion) {
  drive(kPerson, 0.0, 0.8);
  const ObstacleMap before = map_.snapshot();
  rest({}, 200);
  const ObstacleMap after = map_.snapshot();
  EXPECT_EQ(countNew(after, before, kCellOccupied), 0);
  EXPECT_EQ(countNew(before, after, kCellFree), 0);
  // Positions and heights from motion stay, too.
  rest({{{{1.7, 2.8, 0.0}, {2.1, 3.2, 0.4}}}}, 50);
  EXPECT_EQ(cv::norm(map_.snapshot().height_m, before.height_m, cv::NORM_INF, before.state == kCellOccupied),
            0.0);
  drive({}, 0.9, 0.9 + 11 * 0.1);
  EXPECT_EQ(stateAt(1.9, 2.85), kCellFree);
}

TEST_F(LocalObstacleMapTest, WhateverMapsAtRestShowTheyOnlyTakeFreedomAndOccupy) {
  drive(kPerson, 0.0, 0.8);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> along(-3.0, 6.0), aside(-6.0, 6.0);
  for (int i = 0; i < 30; ++i) {
    BoxWorld world;
    for (int k = 0; k < 5; ++k) {
      const double x = along(random), y = aside(random);
      world.boxes.push_back({{x, y, 0.0}, {x + 0.5, y + 0.5, 1.5}});
    }
    const ObstacleMap before = map_.snapshot();
    rest(i % 2 == 0 ? world : BoxWorld(), 1 + i % 7, {0.05, 0.3, 1});
    const ObstacleMap after = map_.snapshot();
    ASSERT_EQ(countNew(before, after, kCellFree), 0) << i;
  }
  EXPECT_EQ(stateAt(1.9, 2.85), kCellOccupied);
}

TEST_F(LocalObstacleMapTest, AtRestMapsOfAnUnchangedWorldKeepItsStates) {
  drive(kPerson, 0.0, 0.8);
  const ObstacleMap before = map_.snapshot();
  rest(kPerson, 200);
  const ObstacleMap after = map_.snapshot();
  EXPECT_GE(countCells(after, kCellFree), 98 * countCells(before, kCellFree) / 100);
  EXPECT_GE(countCells(after, kCellOccupied), countCells(before, kCellOccupied));
  rest(kPerson, 50, {0.01, 1.0, 1});  // no range at all
  EXPECT_EQ(cv::countNonZero(map_.snapshot().state != after.state), 0);
}

TEST_F(LocalObstacleMapTest, WhatIsOccupiedAtRestMovesWithItsFrameAndIsClearedInMotion) {
  rest(kPerson, 10);
  const int occupied = countCells(map_.snapshot(), kCellOccupied);
  ASSERT_GT(occupied, 0);
  const RigidTransform moved = RigidTransform::planar(10.0, -20.0, 0.0);
  map_.reanchor(moved);
  EXPECT_EQ(stateAt(11.9, -17.15), kCellOccupied);
  EXPECT_EQ(countCells(map_.snapshot(), kCellOccupied), occupied);
  map_.reanchor(moved.inverse());
  drive({}, 0.1, 0.8);
  EXPECT_EQ(stateAt(1.9, 2.85), kCellFree);
}

}  // namespace
}  // namespace vcharge
