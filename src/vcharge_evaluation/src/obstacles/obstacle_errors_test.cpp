#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "vcharge_evaluation/obstacle_map_errors.h"
#include "vcharge_evaluation/obstacle_scan_errors.h"

namespace vcharge {
namespace {

/// Visible points of a wall along x of the given height.
std::vector<SeenPoint> makeWall(double height_m, double y_m = 3.0) {
  std::vector<SeenPoint> points;
  for (double x = -6.0; x < 6.0; x += 0.01) {
    for (double z = 0.02; z < height_m; z += 0.02) {
      points.push_back({Eigen::Vector3d(x, y_m, z).cast<float>(), 1.0F});
    }
  }
  return points;
}

ObstacleScan makeScan(double wall_y_m, double error_m) {
  ObstacleScan scan = ObstacleScan::unknown(360, 10.0);
  for (size_t i = 0; i < scan.size(); ++i) {
    const double sine = std::sin(scan.angle_rad(i));
    if (sine > 0.3) {
      scan.range_m[i] = static_cast<float>(wall_y_m / sine + error_m);
      scan.range_sigma_m[i] = 0.05F;
    }
  }
  return scan;
}

TEST(ObstacleScanErrorsTest, KnownErrorIsFound) {
  ObstacleScanEvaluator evaluator;
  evaluator.add(makeScan(3.0, 0.1), makeWall(1.0), RigidTransform());
  const RayErrors errors = evaluator.aside();
  EXPECT_GT(errors.num_judged, 80U);
  EXPECT_NEAR(errors.mean_signed_m, 0.1, 0.05);
  EXPECT_NEAR(errors.error_m.percentile_50, 0.1, 0.03);
  EXPECT_LT(errors.fraction_within_one_sigma, 0.6);
  EXPECT_EQ(evaluator.ahead().num_judged, 0U);
}

TEST(ObstacleScanErrorsTest, UnreportedAndTooDistantWallsAreMissed) {
  ObstacleScanEvaluator evaluator;
  evaluator.add(ObstacleScan::unknown(360, 10.0), makeWall(1.0), RigidTransform());
  EXPECT_EQ(evaluator.aside().num_missed, evaluator.aside().num_judged);
  evaluator.add(makeScan(4.0, 0.0), makeWall(1.0), RigidTransform());
  EXPECT_EQ(evaluator.aside().num_missed, evaluator.aside().num_judged);
  EXPECT_EQ(evaluator.aside().error_m.count, evaluator.aside().num_judged);
  EXPECT_EQ(evaluator.aside().error_m.mean, 0.5) << "missed rays count at their bound";
}

TEST(ObstacleScanErrorsTest, SmallSigmasOfWrongRangesAreBadlyCalibrated) {
  for (const double error_m : {0.0, 0.3}) {
    ObstacleScanEvaluator evaluator;
    evaluator.add(makeScan(3.0, error_m), makeWall(1.0), RigidTransform());
    const RayErrors errors = evaluator.all();
    ASSERT_EQ(errors.calibration.size(), 1U);  // sigma of 5 cm: 15 cm are three of them
    EXPECT_NEAR(errors.calibration[0].mean_confidence, 0.9973, 1e-4);
    EXPECT_NEAR(errors.calibration[0].fraction_right, error_m > 0.0 ? 0.0 : 1.0, 0.1);
  }
}

TEST(ObstacleScanErrorsTest, KerbsAreNotJudgedAsWalls) {
  ObstacleScanEvaluator evaluator;
  evaluator.add(makeScan(3.0, 0.0), makeWall(0.15), RigidTransform());
  EXPECT_EQ(evaluator.aside().num_judged, 0U);
}

TEST(ObstacleScanErrorsTest, WhatHangsOverheadIsJudgedByItself) {
  std::vector<SeenPoint> points = makeWall(1.0);
  const size_t num_of_wall = points.size();
  for (const SeenPoint& point : makeWall(1.98, 2.0)) {
    if (point.world_m.z() > 1.9F) {  // a pipe in front of the wall
      points.push_back(point);
    }
  }
  ASSERT_GT(points.size(), num_of_wall);
  ObstacleScanEvaluator wall_found;
  wall_found.add(makeScan(3.0, 0.0), points, RigidTransform());
  EXPECT_GT(wall_found.all().num_judged, 80U);
  EXPECT_EQ(wall_found.all().num_missed, 0U);
  EXPECT_EQ(wall_found.overhead().num_missed, wall_found.overhead().num_judged);
  ObstacleScanEvaluator pipe_found;
  pipe_found.add(makeScan(2.0, 0.0), points, RigidTransform());
  EXPECT_GT(pipe_found.overhead().num_judged, 80U);
  EXPECT_EQ(pipe_found.overhead().num_missed, 0U);
  EXPECT_EQ(pipe_found.all().num_nearer, 0U) << "what is in front of the wall is no error of the wall";
}

/// A box of 0.4 m beside a path along x, with its height map.
class ObstacleMapErrorsTest : public ::testing::Test {
 protected:
  ObstacleMapErrorsTest() {
    box_.kind = "box";
    box_.footprint_m = {{1.0, 2.5}, {1.4, 2.5}, {1.4, 2.9}, {1.0, 2.9}};
    box_.top_z_m = 0.5;
    heights_.height_m = cv::Mat(200, 200, CV_32FC1, cv::Scalar(0.0));
    heights_.origin_m = {-9.95, -9.95};
    for (int row = 125; row < 129; ++row) {
      heights_.height_m.row(row).colRange(110, 114).setTo(0.5F);
    }
    for (double x = 0.0; x < 3.0; x += 0.1) {
      path_.push_back(RigidTransform::planar(x, 0.0, 0.0));
    }
    for (double x = -1.0; x < 4.0; x += 0.05) {  // visible ground on both sides, but not behind the box
      for (double y = -3.0; y < 2.5; y += 0.05) {
        points_.push_back({Eigen::Vector3d(x, y, 0.0).cast<float>(), 1.0F});
      }
    }
    for (double x = 1.0; x < 1.4; x += 0.02) {
      for (double z = 0.12; z < 0.5; z += 0.05) {
        points_.push_back({Eigen::Vector3d(x, 2.5, z).cast<float>(), 1.0F});
      }
    }
  }
  ObstacleMap mapWith(const std::vector<Eigen::Vector2d>& occupied,
                      const std::vector<Eigen::Vector2d>& free) const {
    ObstacleMap map = ObstacleMap::unobserved({160, 160}, 0.1);
    map.origin_m = {-8.0, -8.0};
    const auto set = [&](const Eigen::Vector2d& position, int8_t state) {
      map.state.at<int8_t>(static_cast<int>(std::floor((position.y() + 8.0) / 0.1)),
                           static_cast<int>(std::floor((position.x() + 8.0) / 0.1))) = state;
    };
    for (const auto& position : occupied) {
      set(position, kCellOccupied);
    }
    for (const auto& position : free) {
      set(position, kCellFree);
    }
    return map;
  }
  ObstacleMapErrors judge(const std::vector<Eigen::Vector2d>& occupied,
                          const std::vector<Eigen::Vector2d>& free, size_t poses = 30) {
    ObstacleMapEvaluator evaluator({box_}, heights_, path_);
    for (size_t i = 0; i < poses; ++i) {
      ObstacleMap map = mapWith(occupied, free);
      map.fixed_from_vehicle = path_[i];
      evaluator.add(map, points_, path_[i], {}, {});
    }
    return evaluator.errors();
  }

  TruthObstacle box_;
  TruthHeights heights_;
  std::vector<RigidTransform> path_;
  std::vector<SeenPoint> points_;
};

TEST_F(ObstacleMapErrorsTest, ObstaclesAreReportedMissedOrNotYetDue) {
  const ObstacleMapErrors reported = judge({{1.05, 2.55}}, {});
  ASSERT_EQ(reported.obstacles.size(), 1U);
  EXPECT_TRUE(reported.obstacles[0].reported);
  EXPECT_NEAR(reported.obstacles[0].distance_m, 1.6, 0.05);
  EXPECT_NEAR(reported.driven_m, 2.9, 1e-6);
  const ObstacleMapErrors missed = judge({{1.05, 3.55}}, {});
  ASSERT_EQ(missed.obstacles.size(), 1U);
  EXPECT_FALSE(missed.obstacles[0].reported);
  EXPECT_TRUE(judge({}, {}, 8).obstacles.empty());  // not yet due
}

TEST_F(ObstacleMapErrorsTest, FalseCellsAndFreeCellsInsideObstaclesAreCounted) {
  const ObstacleMapErrors errors = judge({{1.05, 2.55}, {1.55, -2.0}}, {{1.25, 2.75}, {2.0, 1.5}});
  EXPECT_EQ(errors.num_false_cells, 1U);
  EXPECT_EQ(errors.num_false_left, 1U);
  EXPECT_NEAR(errors.false_cells_per_10_m, 10.0 / 2.9, 0.01);
  EXPECT_EQ(errors.num_free_inside, 1U);
  EXPECT_EQ(errors.num_observed_inside, 1U);
}

TEST_F(ObstacleMapErrorsTest, MovingObjectsAreCountedByKind) {
  TruthObstacle car = box_;
  car.kind = "car";
  TruthObstacle hidden = box_;
  hidden.kind = "bicycle";
  hidden.footprint_m = {{1.0, 6.0}, {2.0, 6.0}, {2.0, 7.0}, {1.0, 7.0}};
  ObstacleMapEvaluator evaluator({}, heights_, path_);
  for (size_t i = 0; i < path_.size(); ++i) {
    ObstacleMap map =
        mapWith(i % 2 == 0 ? std::vector<Eigen::Vector2d>{{1.05, 2.55}} : std::vector<Eigen::Vector2d>{}, {});
    map.fixed_from_vehicle = path_[i];
    evaluator.add(map, points_, path_[i], {car, hidden}, {});
  }
  const auto movers = evaluator.errors().movers;
  ASSERT_EQ(movers.size(), 1U) << "a hidden object is not judged";
  EXPECT_EQ(movers.at("car").frames, path_.size());
  EXPECT_EQ(movers.at("car").frames_reported, path_.size() / 2);
}

TEST_F(ObstacleMapErrorsTest, PointsOfKerbsAreJudgedOnceWithTheirLeastDistance) {
  TruthObstacle kerb;
  kerb.kind = "kerb";
  kerb.footprint_m = {{1.0, -2.5}, {2.0, -2.5}, {2.0, -2.0}, {1.0, -2.0}};
  kerb.top_z_m = 0.12;
  for (int row = 75; row < 80; ++row) {
    heights_.height_m.row(row).colRange(110, 120).setTo(0.12F);
  }
  for (double x = 1.0; x < 2.0; x += 0.01) {  // the side facing the path
    for (const double z : {0.05, 0.08, 0.11}) {
      points_.push_back({Eigen::Vector3d(x, -2.0, z).cast<float>(), 1.0F});
    }
  }
  ObstacleMapEvaluator evaluator({kerb}, heights_, path_);
  for (size_t i = 0; i < path_.size(); ++i) {
    // One point is reported in time, another one too late.
    std::vector<Eigen::Vector2d> occupied = {{1.25, -2.05}};
    if (i > 15) {
      occupied.push_back({1.75, -2.05});
    }
    ObstacleMap map = mapWith(occupied, {});
    map.height_m.setTo(0.10F);
    map.fixed_from_vehicle = path_[i];
    evaluator.add(map, points_, path_[i], {}, {});
  }
  const ObstacleMapErrors errors = evaluator.errors();
  ASSERT_FALSE(errors.kerbs.empty());
  EXPECT_EQ(errors.kerbs.size(), errors.num_kerb_points);
  uint64_t reported = 0;
  uint64_t ever = 0;
  for (const KerbOutcome& kerb_point : errors.kerbs) {
    // The middle of the vehicle, 1.4 m in front of the rear axle, passes all points.
    EXPECT_NEAR(kerb_point.nearest_m, -kerb_point.position_m.y(), 0.05);
    EXPECT_TRUE(kerb_point.ever_reported || !kerb_point.reported);
    reported += kerb_point.reported ? 1 : 0;
    ever += kerb_point.ever_reported ? 1 : 0;
  }
  EXPECT_EQ(reported, errors.num_kerb_reported);
  EXPECT_GT(reported, 0U);
  EXPECT_GT(ever, reported);
  EXPECT_LT(ever, errors.num_kerb_points);
  EXPECT_NEAR(errors.kerb_height_error_m.mean, 0.02, 1e-3);
}

TEST_F(ObstacleMapErrorsTest, OpenGroundIsVisibleAndFarFromObstacles) {
  // 0.25 m in front of the box is within the allowed range error, 0.35 m is not; behind it nothing is
  // visible.
  const ObstacleMapErrors errors = judge({{1.25, 2.25}, {1.25, 2.15}, {1.25, 3.35}}, {});
  EXPECT_EQ(errors.num_false_cells, 1U);
  EXPECT_EQ(errors.num_false_hidden, 1U);
  EXPECT_NEAR(errors.false_cells_per_map, 1.0, 1e-9);
  ASSERT_EQ(errors.false_cells.size(), 2U);
  EXPECT_NEAR(errors.false_cells[0].world_m.y(), 2.15, 1e-6);
  EXPECT_TRUE(errors.false_cells[0].is_on_open);
  EXPECT_EQ(errors.false_cells[0].frames, 30U);
}

TEST_F(ObstacleMapErrorsTest, FalseCellCountsOnceAndIsLeftOnlyWhileOccupied) {
  ObstacleMapEvaluator evaluator({box_}, heights_, path_);
  for (size_t i = 0; i < path_.size(); ++i) {
    ObstacleMap map =
        mapWith(i < 10 ? std::vector<Eigen::Vector2d>{{1.55, -2.0}} : std::vector<Eigen::Vector2d>{}, {});
    map.fixed_from_vehicle = path_[i];
    // The odometry drifts across cells of the world, but the map's cell stays the same.
    evaluator.add(map, points_, RigidTransform::planar(0.1 * i, 0.01 * i, 0.0), {}, {});
  }
  EXPECT_EQ(evaluator.errors().num_false_cells, 1U);
  EXPECT_EQ(evaluator.errors().num_false_left, 0U);
}

TEST(ObstacleTruthTest, CellsOfTheWorldHaveUniqueKeys) {
  SeenCells cells;
  cells.add({-0.05, -3.25}, 3);
  cells.add({-0.15, -3.25}, 2);
  cells.add({5.0, 5.0}, 7);
  EXPECT_EQ(cells.countAround({-0.05, -3.25}), 5);
  EXPECT_EQ(cells.counts().size(), 3U);
  for (const auto& [key, count] : cells.counts()) {
    EXPECT_EQ(SeenCells::keyOf(SeenCells::middleOf(key)), key) << count;
  }
}

}  // namespace
}  // namespace vcharge
