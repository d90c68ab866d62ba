#include "vcharge_obstacles/local_obstacle_map.h"

#include <cmath>

#include <gtest/gtest.h>

#include "box_world.h"

namespace vcharge {
namespace {

/// Drives a rig through a world straight along x and fuses what the cameras see.
class LocalObstacleMapTest : public ::testing::Test {
 protected:
  LocalObstacleMapTest() : grid_(detector_options_.grid) {
    for (const RigCamera& camera : rig_.cameras) {
      const RangeMap map = measureBoxWorld({}, camera, {}, Timestamp());
      detectors_.emplace_back(rebuildWorkingCamera(map.camera, map.range_m.size(), camera),
                              *camera.vehicle_from_camera, detector_options_);
    }
  }

  /// One look of all cameras from x, 80 ms after the one before.
  void look(const BoxWorld& world, double x_m, const BoxWorldNoise& noise = {0.01, 0.1, 1}) {
    stamp_ = stamp_ + durationFromSeconds(0.08);
    const RigidTransform pose = RigidTransform::planar(x_m, 0.0, 0.0);
    pose_ = pose;
    map_.moveTo(stamp_, pose);
    for (size_t i = 0; i < detectors_.size(); ++i) {
      BoxWorldNoise own = noise;
      own.seed = static_cast<uint32_t>(1000 * i) + static_cast<uint32_t>(stamp_.nanoseconds() / 80000000);
      map_.add(detectors_[i].detect(measureBoxWorld(world, rig_.cameras[i], pose, stamp_, own)), grid_, pose);
    }
  }
  void drive(const BoxWorld& world, double from_m, double to_m, double step_m = 0.1) {
    for (double x = from_m; x <= to_m + 1e-9; x += step_m) {
      look(world, x);
    }
  }
  int8_t stateAt(double x_m, double y_m) const { return stateIn(map_.snapshot(), x_m, y_m); }
  static int8_t stateIn(const ObstacleMap& map, double x_m, double y_m) {
    const Eigen::Vector2d cell = (Eigen::Vector2d(x_m, y_m) - map.origin_m) / map.cell_size_m;
    return map.state.at<int8_t>(static_cast<int>(std::floor(cell.y())),
                                static_cast<int>(std::floor(cell.x())));
  }
  static int count(const ObstacleMap& map, int8_t state) { return cv::countNonZero(map.state == state); }

  const CameraRig rig_ = makeBoxWorldRig();
  ObstacleDetectorOptions detector_options_;
  PolarGrid grid_;
  std::vector<ObstacleDetector> detectors_;
  LocalObstacleMap map_;
  Timestamp stamp_;
  RigidTransform pose_;
};

const BoxWorld kPerson{{{{1.7, 2.8, 0.0}, {2.1, 3.2, 1.7}}}};

TEST_F(LocalObstacleMapTest, LooksWithoutWeightLeaveNoTrace) {
  CameraObstacles seen;
  seen.camera_name = "front";
  seen.camera_height_m = 0.6;
  seen.free_share.assign(grid_.size(), 0.0F);
  seen.hidden_share = seen.unknown_share = seen.free_share;
  PolarObstacle wall;
  wall.ray = grid_.rayOf(0.0);
  wall.range_m = 3.05;
  wall.range_sigma_m = 0.03;
  wall.height_m = 1.0;
  wall.support = 1.0;
  for (const double weight : {0.0, 1.0, 1.0, 1.0}) {
    wall.weight = weight;
    seen.obstacles = {wall};
    seen.camera_name += "x";  // a camera's first look counts in full
    stamp_ = stamp_ + durationFromSeconds(0.08);
    map_.moveTo(stamp_, {});
    map_.add(seen, grid_, {});
    if (weight == 0.0) {
      EXPECT_EQ(count(map_.snapshot(), kCellUnobserved), map_.snapshot().state.size().area());
    }
  }
  const ObstacleMap map = map_.snapshot();
  const cv::Mat occupied = map.state == kCellOccupied;
  ASSERT_EQ(cv::countNonZero(occupied), 1);
  std::vector<cv::Point> places;
  cv::findNonZero(occupied, places);
  EXPECT_NEAR(map.height_m.at<float>(places[0]), 1.0F, 1e-4F);
}

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

TEST_F(LocalObstacleMapTest, ScanMeetsThePersonWithinItsSigmas) {
  drive(kPerson, 0.0, 0.8);
  const ObstacleScan scan = map_.scan();
  // The side towards the path, from (0.8, 0).
  const double angle_rad = std::atan2(2.8, 1.9 - 0.8);
  const auto ray =
      static_cast<size_t>(std::lround((angle_rad - scan.angle_min_rad) / scan.angle_increment_rad));
  const double expected_m = 2.8 / std::sin(scan.angle_rad(ray));
  EXPECT_NEAR(scan.range_m[ray], expected_m, 0.06);
  EXPECT_NEAR(scan.range_m[ray], expected_m, 3.0 * scan.range_sigma_m[ray]);
  EXPECT_GT(scan.height_m[ray], 0.8F);
}

TEST_F(LocalObstacleMapTest, WhoWalksAwayIsClearedWithinASecondOnceSeenFree) {
  drive(kPerson, 0.0, 0.8);
  ASSERT_EQ(stateAt(1.9, 2.85), kCellOccupied);
  drive({}, 0.9, 0.9 + 11 * 0.1);  // 12 looks: 0.96 s
  EXPECT_EQ(stateAt(1.9, 2.85), kCellFree);
  EXPECT_EQ(stateAt(1.9, 2.95), kCellFree);
}

constexpr double kFlankY_m = 5.0;

/// What a camera at (x, 0) that looks along the axes says of a flank from (-1, kFlankY_m) to (1, kFlankY_m),
/// when all its ranges err by error_m.
CameraObstacles makeLookAtFlank(double x_m, double sigma_m, double error_m, const PolarGrid& grid) {
  CameraObstacles seen;
  seen.camera_name = "left";
  seen.camera_height_m = 0.9;
  seen.free_share.assign(grid.size(), 0.0F);
  seen.hidden_share = seen.unknown_share = seen.free_share;
  for (int ray = 0; ray < grid.numRays(); ++ray) {
    const double sine = std::sin(grid.angle_rad(ray));
    const double range_m = kFlankY_m / sine;
    if (sine > 0.0 && std::abs(x_m + range_m * std::cos(grid.angle_rad(ray))) < 1.0) {
      PolarObstacle obstacle;
      obstacle.ray = ray;
      obstacle.range_m = range_m + error_m;
      obstacle.range_sigma_m = sigma_m;
      obstacle.height_m = 1.0;
      obstacle.support = 1.0;
      seen.obstacles.push_back(obstacle);
    }
  }
  return seen;
}

TEST_F(LocalObstacleMapTest, ManyUncertainLooksDoNotMarkWhatIsFarFromTheObstacle) {
  // Ranges that scatter as their sigma says, of a camera that passes by.
  for (const double sigma_m : {0.05, 0.4}) {
    LocalObstacleMap map;
    for (int i = 0; i <= 100; ++i) {
      const RigidTransform pose = RigidTransform::planar(-2.5 + 0.05 * i, 0.0, 0.0);
      map.moveTo(stamp_, pose);
      const double error_m = sigma_m * ((i % 5) - 2) / std::sqrt(2.0);
      map.add(makeLookAtFlank(pose.translation().x(), sigma_m, error_m, grid_), grid_, pose);
    }
    const ObstacleMap result = map.snapshot();
    const int to_flank =
        static_cast<int>(std::lround((kFlankY_m - result.origin_m.y()) / result.cell_size_m));
    // The range error that is allowed, and the diagonal of a cell.
    EXPECT_EQ(cv::countNonZero(result.state.rowRange(0, to_flank - 3) == kCellOccupied), 0) << sigma_m;
    if (sigma_m < 0.1) {
      EXPECT_EQ(stateIn(result, 0.05, kFlankY_m + 0.05), kCellOccupied);
    }
  }
}

/// What a low camera at (x, 0) says that sees ground wherever it looks, as it does under the body of a car.
CameraObstacles makeLookAtGround(Timestamp stamp, const PolarGrid& grid) {
  CameraObstacles seen;
  seen.stamp = stamp;
  seen.camera_name = "front";
  seen.camera_height_m = 0.55;
  seen.free_share.assign(grid.size(), 1.0F);
  seen.hidden_share.assign(grid.size(), 0.0F);
  seen.unknown_share = seen.hidden_share;
  return seen;
}

TEST_F(LocalObstacleMapTest, GroundUnderABodyThatAnotherCameraSeesIsNotFree) {
  const double near_y_m = kFlankY_m - 0.55, under_y_m = kFlankY_m + 0.65;
  for (const double height_m : {1.0, 0.05}) {
    for (const double shadow_s : {0.2, 0.0}) {
      LocalObstacleMapOptions options;
      options.shadow_s = shadow_s;
      LocalObstacleMap map(options);
      Timestamp stamp;
      const auto pass = [&](int from, int to, bool flank_is_seen) {
        for (int i = from; i < to; ++i) {
          stamp = stamp + durationFromSeconds(0.08);
          const RigidTransform pose = RigidTransform::planar(-1.0 + 0.1 * i, 0.0, 0.0);
          map.moveTo(stamp, pose);
          CameraObstacles flank = makeLookAtFlank(pose.translation().x(), 0.03, 0.0, grid_);
          flank.stamp = stamp;
          for (PolarObstacle& obstacle : flank.obstacles) {
            obstacle.height_m = height_m;
          }
          if (flank_is_seen) {
            map.add(flank, grid_, pose);
          }
          if (i >= 5) {
            map.add(makeLookAtGround(stamp, grid_), grid_, pose);
          }
        }
      };
      pass(0, 15, true);
      const bool may_be_seen = height_m < 0.5 || shadow_s == 0.0;  // over it, or by mistake
      EXPECT_EQ(stateIn(map.snapshot(), 0.05, near_y_m), kCellFree);
      EXPECT_EQ(stateIn(map.snapshot(), 0.05, under_y_m), may_be_seen ? kCellFree : kCellUnobserved)
          << height_m << " " << shadow_s;
      // Nobody sees the flank any more: it is not there.
      pass(15, 30, false);
      EXPECT_EQ(stateIn(map.snapshot(), 0.05, under_y_m), kCellFree);
    }
  }
}

TEST_F(LocalObstacleMapTest, GroundSeenFarOffTheAxisKeepsWhatIsFreeAndMakesNothingFree) {
  const double place_m = 2.05;
  LocalObstacleMap map;
  Timestamp stamp;
  const auto look = [&](bool is_off_axis, int times) {
    for (int i = 0; i < times; ++i) {
      stamp = stamp + durationFromSeconds(0.08);
      const RigidTransform pose = RigidTransform::planar(0.1 * i, 0.0, 0.0);
      map.moveTo(stamp, pose);
      CameraObstacles ground = makeLookAtGround(stamp, grid_);
      ground.free_to_m.assign(static_cast<size_t>(grid_.numRays()),
                              is_off_axis ? 1.5 : std::numeric_limits<double>::infinity());
      map.add(ground, grid_, pose);
    }
    return map.snapshot();
  };
  ObstacleMap seen = look(true, 8);
  EXPECT_EQ(stateIn(seen, 0.05, place_m), kCellUnobserved);
  EXPECT_EQ(stateIn(seen, 0.05, 0.5 * place_m), kCellFree);  // near enough
  seen = look(false, 8);
  EXPECT_EQ(stateIn(seen, 0.05, place_m), kCellFree);
  const int num_free = count(seen, kCellFree);
  // Back and forth over so much way that a cell which is not seen is forgotten.
  for (int times = 0; times < 20; ++times) {
    seen = look(true, 8);
  }
  EXPECT_EQ(stateIn(seen, 0.05, place_m), kCellFree);
  EXPECT_LE(count(seen, kCellFree), num_free);
  // What was an obstacle is one no longer, but no free ground yet.
  map.clear();
  for (int i = 0; i < 8; ++i) {
    const RigidTransform pose = RigidTransform::planar(0.1 * i, 0.0, 0.0);
    stamp = stamp + durationFromSeconds(0.08);
    map.moveTo(stamp, pose);
    map.add(makeLookAtFlank(pose.translation().x(), 0.03, 0.0, grid_), grid_, pose);
  }
  ASSERT_EQ(stateIn(map.snapshot(), 0.05, kFlankY_m + 0.05), kCellOccupied);
  seen = look(true, 16);
  EXPECT_EQ(stateIn(seen, 0.05, kFlankY_m + 0.05), kCellUnobserved);
}

TEST_F(LocalObstacleMapTest, LooksOfLittleWeightNeedMoreOfThem) {
  const auto looksUntilOccupied = [&](double look_weight) {
    LocalObstacleMap map;
    for (int looks = 1; looks < 200; ++looks) {
      const RigidTransform pose = RigidTransform::planar(-0.9 + 0.1 * (looks % 18), 0.0, 0.0);
      map.moveTo(stamp_, pose);
      CameraObstacles seen = makeLookAtFlank(pose.translation().x(), 0.03, 0.0, grid_);
      for (PolarObstacle& obstacle : seen.obstacles) {
        obstacle.weight = look_weight;
      }
      map.add(seen, grid_, pose);
      if (count(map.snapshot(), kCellOccupied) > 0) {
        return looks;
      }
    }
    return 200;
  };
  const int full = looksUntilOccupied(1.0);
  const int ramp = looksUntilOccupied(0.25);
  EXPECT_LT(full, 6);
  EXPECT_GE(ramp, 3 * full);
  EXPECT_LT(ramp, 30);
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

TEST_F(LocalObstacleMapTest, WhatIsNotSeenAgainIsForgottenNeverFreed) {
  drive(kPerson, 0.0, 0.8);
  const ObstacleMap before = map_.snapshot();
  // Blind for 6 m: the person's cell is still in the map.
  for (int i = 1; i <= 60; ++i) {
    map_.moveTo(stamp_, RigidTransform::planar(0.8 + 0.1 * i, 0.0, 0.0));
  }
  const ObstacleMap after = map_.snapshot();
  EXPECT_EQ(stateIn(before, 1.9, 2.2), kCellFree);
  EXPECT_EQ(stateIn(after, 1.9, 2.2), kCellUnobserved);
  EXPECT_GT(count(before, kCellFree), 500);
  EXPECT_EQ(count(after, kCellFree), 0);
}

TEST_F(LocalObstacleMapTest, UnknownRangesNeverFreeAndDoubtWhatWasFree) {
  drive({}, 0.0, 0.8);
  const ObstacleMap before = map_.snapshot();
  for (double x = 0.9; x < 1.7; x += 0.1) {
    look({}, x, {0.01, 1.0, 1});  // no range at all: night
    const ObstacleMap now = map_.snapshot();
    EXPECT_LE(count(now, kCellFree), count(before, kCellFree));
    EXPECT_EQ(count(now, kCellOccupied), 0);
  }
  EXPECT_EQ(stateAt(1.9, 2.2), kCellUnobserved);
}

TEST_F(LocalObstacleMapTest, WhoStepsIntoFreeGroundMakesItAtLeastUnsure) {
  drive({}, 0.0, 0.8);
  ASSERT_EQ(stateAt(1.9, 3.0), kCellFree);
  drive(kPerson, 0.9, 1.2);
  EXPECT_NE(stateAt(1.9, 2.85), kCellFree);
  EXPECT_NE(stateAt(1.9, 3.05), kCellFree);
  EXPECT_NE(stateAt(1.9, 3.3), kCellFree);  // hidden behind
}

TEST_F(LocalObstacleMapTest, GroundThatLooksOtherwiseIsTakenBackAtOnceAndHeld) {
  drive({}, 0.0, 0.8);
  ASSERT_EQ(stateAt(1.9, 3.0), kCellFree);
  ASSERT_EQ(stateAt(1.9, 2.7), kCellFree);
  // The range map still says that all is bare ground, as where a window matches the ground beside a foot.
  const auto lookAtChange = [&](double x_m, bool changed) {
    stamp_ = stamp_ + durationFromSeconds(0.08);
    const RigidTransform pose = RigidTransform::planar(x_m, 0.0, 0.0);
    map_.moveTo(stamp_, pose);
    CameraObstacles seen = detectors_[1].detect(measureBoxWorld({}, rig_.cameras[1], pose, stamp_));
    const Eigen::Vector2d offset = Eigen::Vector2d(1.9 - x_m, 3.0) - seen.origin_m;
    seen.changed_share.assign(grid_.size(), 0.0F);
    for (int side = -2; side <= 2 && changed; ++side) {
      const int ray = grid_.wrap(grid_.rayOf(std::atan2(offset.y(), offset.x())) + side);
      const int bin = grid_.binOfInverse(static_cast<float>(1.0 / offset.norm()));
      seen.changed_share[grid_.index(ray, bin)] = seen.changed_share[grid_.index(ray, bin + 1)] = 1.0F;
    }
    map_.add(seen, grid_, pose);
  };
  lookAtChange(0.9, true);
  EXPECT_EQ(stateAt(1.9, 3.0), kCellUnobserved);
  EXPECT_EQ(stateAt(1.9, 2.7), kCellUnobserved);  // within the margin
  EXPECT_EQ(stateAt(1.9, 2.2), kCellFree);
  for (int i = 1; i <= 3; ++i) {
    lookAtChange(0.9 + 0.1 * i, false);
    EXPECT_EQ(stateAt(1.9, 3.0), kCellUnobserved);
  }
  for (int i = 4; i <= 10; ++i) {
    lookAtChange(0.9 + 0.1 * i, false);
  }
  EXPECT_EQ(stateAt(1.9, 3.0), kCellFree);  // within a second
}

TEST_F(LocalObstacleMapTest, ScrollingKeepsPlacesInTheFixedFrame) {
  const BoxWorld world{{{{4.0, 3.0, 0.0}, {4.4, 3.4, 1.0}}}};
  drive(world, 0.0, 3.3);  // crosses many cells
  EXPECT_EQ(stateAt(4.2, 3.05), kCellOccupied);
  EXPECT_NE(stateAt(3.5, 3.05), kCellOccupied);
  map_.moveTo(stamp_, RigidTransform::planar(100.0, 0.0, 0.0));
  EXPECT_EQ(count(map_.snapshot(), kCellUnobserved), map_.snapshot().state.rows * map_.snapshot().state.cols);
}

TEST_F(LocalObstacleMapTest, ReanchoringMovesObstaclesWithTheirFrame) {
  drive(kPerson, 0.0, 0.8);
  const int occupied = count(map_.snapshot(), kCellOccupied);
  const RigidTransform moved = RigidTransform::planar(0.53, -1.27, 0.2);
  map_.reanchor(moved);
  const ObstacleMap map = map_.snapshot();
  const Eigen::Vector3d person = moved * Eigen::Vector3d(1.9, 2.85, 0.0);
  bool found = false;  // in its cell, or the one beside it
  for (const double x : {-0.1, 0.0, 0.1}) {
    for (const double y : {-0.1, 0.0, 0.1}) {
      found = found || stateIn(map, person.x() + x, person.y() + y) == kCellOccupied;
    }
  }
  EXPECT_TRUE(found);
  const Eigen::Vector3d free = moved * Eigen::Vector3d(1.9, 2.2, 0.0);
  EXPECT_EQ(stateIn(map, free.x(), free.y()), kCellFree);
  EXPECT_GE(count(map, kCellOccupied), occupied / 2);
  EXPECT_LE(count(map, kCellOccupied), occupied);
  EXPECT_NEAR((map.fixed_from_vehicle.translation() - moved * Eigen::Vector3d(0.8, 0.0, 0.0)).norm(), 0.0,
              1e-9);
}

TEST_F(LocalObstacleMapTest, UncertainLooksMarkMoreCellsMoreSlowly) {
  const auto looksUntilOccupied = [&](double sigma_m) {
    LocalObstacleMap map;
    CameraObstacles seen = detectors_[1].detect(measureBoxWorld({}, rig_.cameras[1], {}, stamp_));
    std::fill(seen.free_share.begin(), seen.free_share.end(), 0.0F);
    PolarObstacle obstacle;
    obstacle.ray = grid_.rayOf(0.5 * M_PI);
    obstacle.range_m = 3.02;
    obstacle.range_sigma_m = sigma_m;
    obstacle.height_m = 1.0;
    obstacle.support = 1.0;
    seen.obstacles = {obstacle};
    for (int looks = 1; looks < 200; ++looks) {
      const RigidTransform pose = RigidTransform::planar(0.1 * looks, 0.0, 0.0);
      seen.origin_m.x() = 1.9 - 0.1 * looks;  // the camera sees the same place from the same place
      map.moveTo(stamp_, RigidTransform());
      map.add(seen, grid_, pose);
      seen.camera_name = std::to_string(looks);  // each look counts in full
      if (count(map.snapshot(), kCellOccupied) > 0) {
        return looks;
      }
    }
    return 200;
  };
  const int sure = looksUntilOccupied(0.03);
  const int unsure = looksUntilOccupied(0.3);
  EXPECT_LT(sure, 8);
  EXPECT_GT(unsure, 3 * sure);
}

TEST_F(LocalObstacleMapTest, RangesAlongTheTravelAreUncertain) {
  const auto sigmaAt = [&](double angle_rad) {
    LocalObstacleMap map;
    CameraObstacles seen = detectors_[0].detect(measureBoxWorld({}, rig_.cameras[0], {}, stamp_));
    std::fill(seen.free_share.begin(), seen.free_share.end(), 0.0F);
    PolarObstacle obstacle;
    obstacle.ray = grid_.rayOf(angle_rad);
    obstacle.range_m = 3.0;
    obstacle.range_sigma_m = 0.02;
    obstacle.height_m = 1.0;
    obstacle.support = 1.0;
    seen.obstacles = {obstacle};
    for (int looks = 0; looks < 40; ++looks) {
      const RigidTransform pose = RigidTransform::planar(0.1 * looks, 0.0, 0.0);
      map.moveTo(stamp_, pose);
      seen.origin_m.x() = 3.6 - 0.1 * looks;  // the camera sees the same place from the same place
      seen.camera_name = std::to_string(looks);
      map.add(seen, grid_, pose);
    }
    double largest = 0.0;
    const ObstacleMap result = map.snapshot();
    cv::minMaxLoc(result.point_sigma_m, nullptr, &largest, nullptr, nullptr, result.state == kCellOccupied);
    return largest;
  };
  const double aside_m = sigmaAt(0.5 * M_PI - 0.01);
  const double ahead_m = sigmaAt(0.1);
  EXPECT_LT(aside_m, 0.06);
  // A direction of motion that errs by parallax_sigma, seen under 0.1 rad.
  EXPECT_GT(ahead_m, LocalObstacleMapOptions().parallax_sigma * 3.0 / std::tan(0.12));
}

TEST_F(LocalObstacleMapTest, LooksFromTheSamePlaceCountOnce) {
  look(kPerson, 0.0);
  const ObstacleMap first = map_.snapshot();
  for (int i = 0; i < 50; ++i) {
    look(kPerson, 0.0);
  }
  EXPECT_EQ(count(map_.snapshot(), kCellFree), count(first, kCellFree));
  EXPECT_EQ(count(map_.snapshot(), kCellOccupied), count(first, kCellOccupied));
}

}  // namespace
}  // namespace vcharge
