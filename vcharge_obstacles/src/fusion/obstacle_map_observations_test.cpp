#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "fusion/obstacle_map_cells.h"
#include "vcharge_obstacles/local_obstacle_map.h"

// Tests single synthetic observations and their effect on a LocalObstacleMap.

namespace vcharge {
namespace {

constexpr double kFlankY_m = 5.0;

class ObstacleMapObservationsTest : public ::testing::Test {
 protected:
  /// A camera above the vehicle's origin that observes this fraction of bare ground in every cell.
  CameraObstacles makeObservation(const std::string& camera_name, double camera_height_m,
                                  float free_fraction) const {
    CameraObstacles seen;
    seen.stamp = stamp_;
    seen.camera_name = camera_name;
    seen.camera_height_m = camera_height_m;
    seen.free_fraction.assign(grid_.size(), free_fraction);
    seen.hidden_fraction.assign(grid_.size(), 0.0F);
    seen.unknown_fraction = seen.hidden_fraction;
    return seen;
  }

  /// A low camera that observes bare ground everywhere, even under the body of a car.
  CameraObstacles makeGroundObservation() const { return makeObservation("front", 0.55, 1.0F); }

  /// A camera at (x, 0) that observes a flank from (-1, kFlankY_m) to (1, kFlankY_m), with one error in all
  /// ranges.
  CameraObstacles makeFlankObservation(double x_m, double sigma_m, double error_m) const {
    CameraObstacles seen = makeObservation("left", 0.9, 0.0F);
    for (int ray = 0; ray < grid_.numRays(); ++ray) {
      const double sine = std::sin(grid_.angle_rad(ray));
      const double range_m = kFlankY_m / sine;
      if (sine > 0.0 && std::abs(x_m + range_m * std::cos(grid_.angle_rad(ray))) < 1.0) {
        seen.obstacles.push_back(makeObstacle(ray, range_m + error_m, sigma_m));
      }
    }
    return seen;
  }

  /// An obstacle 1 m high in one sector.
  static PolarObstacle makeObstacle(int ray, double range_m, double range_sigma_m) {
    PolarObstacle obstacle;
    obstacle.ray = ray;
    obstacle.range_m = range_m;
    obstacle.range_sigma_m = range_sigma_m;
    obstacle.height_m = 1.0;
    obstacle.support = 1.0;
    return obstacle;
  }

  /// Number of observations until the first cell is occupied, at most 200. Observations are numbered from 1.
  static int observationsUntilOccupied(
      const std::function<void(int number, LocalObstacleMap* map)>& observe) {
    LocalObstacleMap map;
    for (int number = 1; number < 200; ++number) {
      observe(number, &map);
      if (countCells(map.snapshot(), kCellOccupied) > 0) {
        return number;
      }
    }
    return 200;
  }

  PolarGrid grid_{ObstacleDetectorOptions().grid};
  Timestamp stamp_;
};

TEST_F(ObstacleMapObservationsTest, ObservationsWithoutWeightChangeNothing) {
  LocalObstacleMap map;
  CameraObstacles seen = makeObservation("front", 0.6, 0.0F);
  PolarObstacle wall = makeObstacle(grid_.rayOf(0.0), 3.05, 0.03);
  for (const double weight : {0.0, 1.0, 1.0, 1.0}) {
    wall.weight = weight;
    seen.obstacles = {wall};
    seen.camera_name += "x";  // the first observation of a camera has full weight
    stamp_ = stamp_ + durationFromSeconds(0.08);
    map.moveTo(stamp_, {});
    map.add(seen, grid_, {});
    if (weight == 0.0) {
      EXPECT_EQ(countCells(map.snapshot(), kCellUnobserved), map.snapshot().state.size().area());
    }
  }
  const ObstacleMap result = map.snapshot();
  const cv::Mat occupied = result.state == kCellOccupied;
  ASSERT_EQ(cv::countNonZero(occupied), 1);
  std::vector<cv::Point> cells;
  cv::findNonZero(occupied, cells);
  EXPECT_NEAR(result.height_m.at<float>(cells[0]), 1.0F, 1e-4F);
}

TEST_F(ObstacleMapObservationsTest, ManyUncertainObservationsMarkNothingFarFromTheObstacle) {
  // A passing camera whose range errors match their sigma.
  for (const double sigma_m : {0.05, 0.4}) {
    LocalObstacleMap map;
    for (int i = 0; i <= 100; ++i) {
      const RigidTransform pose = RigidTransform::planar(-2.5 + 0.05 * i, 0.0, 0.0);
      map.moveTo(stamp_, pose);
      const double error_m = sigma_m * ((i % 5) - 2) / std::sqrt(2.0);
      map.add(makeFlankObservation(pose.translation().x(), sigma_m, error_m), grid_, pose);
    }
    const ObstacleMap result = map.snapshot();
    const int to_flank =
        static_cast<int>(std::lround((kFlankY_m - result.origin_m.y()) / result.cell_size_m));
    // Allows the range error and the diagonal of a cell.
    EXPECT_EQ(cv::countNonZero(result.state.rowRange(0, to_flank - 3) == kCellOccupied), 0) << sigma_m;
    if (sigma_m < 0.1) {
      EXPECT_EQ(stateIn(result, 0.05, kFlankY_m + 0.05), kCellOccupied);
    }
  }
}

TEST_F(ObstacleMapObservationsTest, GroundUnderABodyObservedByAnotherCameraIsNotFree) {
  const double near_y_m = kFlankY_m - 0.55, under_y_m = kFlankY_m + 0.65;
  for (const double height_m : {1.0, 0.05}) {
    for (const double shadow_s : {0.2, 0.0}) {
      LocalObstacleMapOptions options;
      options.shadow_s = shadow_s;
      LocalObstacleMap map(options);
      const auto pass = [&](int from, int to, bool flank_is_seen) {
        for (int i = from; i < to; ++i) {
          stamp_ = stamp_ + durationFromSeconds(0.08);
          const RigidTransform pose = RigidTransform::planar(-1.0 + 0.1 * i, 0.0, 0.0);
          map.moveTo(stamp_, pose);
          CameraObstacles flank = makeFlankObservation(pose.translation().x(), 0.03, 0.0);
          for (PolarObstacle& obstacle : flank.obstacles) {
            obstacle.height_m = height_m;
          }
          if (flank_is_seen) {
            map.add(flank, grid_, pose);
          }
          if (i >= 5) {
            map.add(makeGroundObservation(), grid_, pose);
          }
        }
      };
      pass(0, 15, true);
      const bool may_be_seen = height_m < 0.5 || shadow_s == 0.0;  // over a low obstacle, or without shadows
      EXPECT_EQ(stateIn(map.snapshot(), 0.05, near_y_m), kCellFree);
      EXPECT_EQ(stateIn(map.snapshot(), 0.05, under_y_m), may_be_seen ? kCellFree : kCellUnobserved)
          << height_m << " " << shadow_s;
      // The flank is no longer observed.
      pass(15, 30, false);
      EXPECT_EQ(stateIn(map.snapshot(), 0.05, under_y_m), kCellFree);
    }
  }
}

TEST_F(ObstacleMapObservationsTest, GroundFarOffTheAxisConfirmsFreeCellsAndFreesNone) {
  const double free_y_m = 2.05;
  LocalObstacleMap map;
  const auto observe = [&](bool is_off_axis, int times) {
    for (int i = 0; i < times; ++i) {
      stamp_ = stamp_ + durationFromSeconds(0.08);
      const RigidTransform pose = RigidTransform::planar(0.1 * i, 0.0, 0.0);
      map.moveTo(stamp_, pose);
      CameraObstacles ground = makeGroundObservation();
      ground.free_to_m.assign(static_cast<size_t>(grid_.numRays()),
                              is_off_axis ? 1.5 : std::numeric_limits<double>::infinity());
      map.add(ground, grid_, pose);
    }
    return map.snapshot();
  };
  ObstacleMap seen = observe(true, 8);
  EXPECT_EQ(stateIn(seen, 0.05, free_y_m), kCellUnobserved);
  EXPECT_EQ(stateIn(seen, 0.05, 0.5 * free_y_m), kCellFree);  // near enough
  seen = observe(false, 8);
  EXPECT_EQ(stateIn(seen, 0.05, free_y_m), kCellFree);
  const int num_free = countCells(seen, kCellFree);
  // Drives back and forth until a cell without observations would have decayed.
  for (int times = 0; times < 20; ++times) {
    seen = observe(true, 8);
  }
  EXPECT_EQ(stateIn(seen, 0.05, free_y_m), kCellFree);
  EXPECT_LE(countCells(seen, kCellFree), num_free);
  // A removed obstacle becomes unobserved, not free.
  map = LocalObstacleMap();
  for (int i = 0; i < 8; ++i) {
    const RigidTransform pose = RigidTransform::planar(0.1 * i, 0.0, 0.0);
    stamp_ = stamp_ + durationFromSeconds(0.08);
    map.moveTo(stamp_, pose);
    map.add(makeFlankObservation(pose.translation().x(), 0.03, 0.0), grid_, pose);
  }
  ASSERT_EQ(stateIn(map.snapshot(), 0.05, kFlankY_m + 0.05), kCellOccupied);
  seen = observe(true, 16);
  EXPECT_EQ(stateIn(seen, 0.05, kFlankY_m + 0.05), kCellUnobserved);
}

TEST_F(ObstacleMapObservationsTest, ObservationsOfLittleWeightAccumulateSlowly) {
  const auto observationsOfWeight = [&](double observation_weight) {
    return observationsUntilOccupied([&](int number, LocalObstacleMap* map) {
      const RigidTransform pose = RigidTransform::planar(-0.9 + 0.1 * (number % 18), 0.0, 0.0);
      map->moveTo(stamp_, pose);
      CameraObstacles seen = makeFlankObservation(pose.translation().x(), 0.03, 0.0);
      for (PolarObstacle& obstacle : seen.obstacles) {
        obstacle.weight = observation_weight;
      }
      map->add(seen, grid_, pose);
    });
  };
  const int full = observationsOfWeight(1.0);
  const int ramp = observationsOfWeight(0.25);
  EXPECT_LT(full, 6);
  EXPECT_GE(ramp, 3 * full);
  EXPECT_LT(ramp, 30);
}

TEST_F(ObstacleMapObservationsTest, UncertainObservationsAccumulateSlowly) {
  const auto observationsOfSigma = [&](double sigma_m) {
    CameraObstacles seen = makeObservation("left", 0.9, 0.0F);
    seen.obstacles = {makeObstacle(grid_.rayOf(0.5 * M_PI), 3.02, sigma_m)};
    return observationsUntilOccupied([&](int number, LocalObstacleMap* map) {
      const RigidTransform pose = RigidTransform::planar(0.1 * number, 0.0, 0.0);
      seen.origin_m.x() = 1.9 - 0.1 * number;  // the camera itself does not move
      map->moveTo(stamp_, RigidTransform());
      map->add(seen, grid_, pose);
      seen.camera_name = std::to_string(number);  // each observation has full weight
    });
  };
  const int sure = observationsOfSigma(0.03);
  const int unsure = observationsOfSigma(0.3);
  EXPECT_LT(sure, 8);
  EXPECT_GT(unsure, 3 * sure);
}

TEST_F(ObstacleMapObservationsTest, RangesAlongTheTravelAreUncertain) {
  const auto sigmaAt = [&](double angle_rad) {
    LocalObstacleMap map;
    CameraObstacles seen = makeObservation("front", 0.6, 0.0F);
    seen.obstacles = {makeObstacle(grid_.rayOf(angle_rad), 3.0, 0.02)};
    for (int i = 0; i < 40; ++i) {
      const RigidTransform pose = RigidTransform::planar(0.1 * i, 0.0, 0.0);
      map.moveTo(stamp_, pose);
      seen.origin_m.x() = 3.6 - 0.1 * i;  // the camera itself does not move
      seen.camera_name = std::to_string(i);
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
  // Includes the error of the direction of motion at 0.1 rad from it.
  EXPECT_GT(ahead_m, LocalObstacleMap::kParallaxSigma * 3.0 / std::tan(0.12));
}

}  // namespace
}  // namespace vcharge
