#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "fusion/obstacle_map_cells.h"
#include "vcharge_obstacles/local_obstacle_map.h"

// What single looks, made by hand, leave in a LocalObstacleMap.

namespace vcharge {
namespace {

constexpr double kFlankY_m = 5.0;

class ObstacleMapLooksTest : public ::testing::Test {
 protected:
  /// A camera over the vehicle's origin that sees ground as this share of every cell's pixels, and else
  /// nothing.
  CameraObstacles makeLook(const std::string& camera_name, double camera_height_m, float free_share) const {
    CameraObstacles seen;
    seen.stamp = stamp_;
    seen.camera_name = camera_name;
    seen.camera_height_m = camera_height_m;
    seen.free_share.assign(grid_.size(), free_share);
    seen.hidden_share.assign(grid_.size(), 0.0F);
    seen.unknown_share = seen.hidden_share;
    return seen;
  }

  /// A low camera that sees ground wherever it looks, as it does under the body of a car.
  CameraObstacles makeLookAtGround() const { return makeLook("front", 0.55, 1.0F); }

  /// What a camera at (x, 0) that looks along the axes says of a flank from (-1, kFlankY_m) to (1,
  /// kFlankY_m), when all its ranges err by error_m.
  CameraObstacles makeLookAtFlank(double x_m, double sigma_m, double error_m) const {
    CameraObstacles seen = makeLook("left", 0.9, 0.0F);
    for (int ray = 0; ray < grid_.numRays(); ++ray) {
      const double sine = std::sin(grid_.angle_rad(ray));
      const double range_m = kFlankY_m / sine;
      if (sine > 0.0 && std::abs(x_m + range_m * std::cos(grid_.angle_rad(ray))) < 1.0) {
        seen.obstacles.push_back(makeObstacle(ray, range_m + error_m, sigma_m));
      }
    }
    return seen;
  }

  /// Something 1 m high in one sector.
  static PolarObstacle makeObstacle(int ray, double range_m, double range_sigma_m) {
    PolarObstacle obstacle;
    obstacle.ray = ray;
    obstacle.range_m = range_m;
    obstacle.range_sigma_m = range_sigma_m;
    obstacle.height_m = 1.0;
    obstacle.support = 1.0;
    return obstacle;
  }

  /// How many looks, numbered from 1, it takes until the first cell is occupied; 200: more.
  static int looksUntilOccupied(const std::function<void(int number, LocalObstacleMap* map)>& look) {
    LocalObstacleMap map;
    for (int number = 1; number < 200; ++number) {
      look(number, &map);
      if (countCells(map.snapshot(), kCellOccupied) > 0) {
        return number;
      }
    }
    return 200;
  }

  PolarGrid grid_{ObstacleDetectorOptions().grid};
  Timestamp stamp_;
};

TEST_F(ObstacleMapLooksTest, LooksWithoutWeightLeaveNoTrace) {
  LocalObstacleMap map;
  CameraObstacles seen = makeLook("front", 0.6, 0.0F);
  PolarObstacle wall = makeObstacle(grid_.rayOf(0.0), 3.05, 0.03);
  for (const double weight : {0.0, 1.0, 1.0, 1.0}) {
    wall.weight = weight;
    seen.obstacles = {wall};
    seen.camera_name += "x";  // a camera's first look counts in full
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
  std::vector<cv::Point> places;
  cv::findNonZero(occupied, places);
  EXPECT_NEAR(result.height_m.at<float>(places[0]), 1.0F, 1e-4F);
}

TEST_F(ObstacleMapLooksTest, ManyUncertainLooksDoNotMarkWhatIsFarFromTheObstacle) {
  // Ranges that scatter as their sigma says, of a camera that passes by.
  for (const double sigma_m : {0.05, 0.4}) {
    LocalObstacleMap map;
    for (int i = 0; i <= 100; ++i) {
      const RigidTransform pose = RigidTransform::planar(-2.5 + 0.05 * i, 0.0, 0.0);
      map.moveTo(stamp_, pose);
      const double error_m = sigma_m * ((i % 5) - 2) / std::sqrt(2.0);
      map.add(makeLookAtFlank(pose.translation().x(), sigma_m, error_m), grid_, pose);
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

TEST_F(ObstacleMapLooksTest, GroundUnderABodyThatAnotherCameraSeesIsNotFree) {
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
          CameraObstacles flank = makeLookAtFlank(pose.translation().x(), 0.03, 0.0);
          for (PolarObstacle& obstacle : flank.obstacles) {
            obstacle.height_m = height_m;
          }
          if (flank_is_seen) {
            map.add(flank, grid_, pose);
          }
          if (i >= 5) {
            map.add(makeLookAtGround(), grid_, pose);
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

TEST_F(ObstacleMapLooksTest, GroundSeenFarOffTheAxisKeepsWhatIsFreeAndMakesNothingFree) {
  const double place_m = 2.05;
  LocalObstacleMap map;
  const auto look = [&](bool is_off_axis, int times) {
    for (int i = 0; i < times; ++i) {
      stamp_ = stamp_ + durationFromSeconds(0.08);
      const RigidTransform pose = RigidTransform::planar(0.1 * i, 0.0, 0.0);
      map.moveTo(stamp_, pose);
      CameraObstacles ground = makeLookAtGround();
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
  const int num_free = countCells(seen, kCellFree);
  // Back and forth over so much way that a cell which is not seen is forgotten.
  for (int times = 0; times < 20; ++times) {
    seen = look(true, 8);
  }
  EXPECT_EQ(stateIn(seen, 0.05, place_m), kCellFree);
  EXPECT_LE(countCells(seen, kCellFree), num_free);
  // What was an obstacle is one no longer, but no free ground yet.
  map.clear();
  for (int i = 0; i < 8; ++i) {
    const RigidTransform pose = RigidTransform::planar(0.1 * i, 0.0, 0.0);
    stamp_ = stamp_ + durationFromSeconds(0.08);
    map.moveTo(stamp_, pose);
    map.add(makeLookAtFlank(pose.translation().x(), 0.03, 0.0), grid_, pose);
  }
  ASSERT_EQ(stateIn(map.snapshot(), 0.05, kFlankY_m + 0.05), kCellOccupied);
  seen = look(true, 16);
  EXPECT_EQ(stateIn(seen, 0.05, kFlankY_m + 0.05), kCellUnobserved);
}

TEST_F(ObstacleMapLooksTest, LooksOfLittleWeightNeedMoreOfThem) {
  const auto looksOfWeight = [&](double look_weight) {
    return looksUntilOccupied([&](int number, LocalObstacleMap* map) {
      const RigidTransform pose = RigidTransform::planar(-0.9 + 0.1 * (number % 18), 0.0, 0.0);
      map->moveTo(stamp_, pose);
      CameraObstacles seen = makeLookAtFlank(pose.translation().x(), 0.03, 0.0);
      for (PolarObstacle& obstacle : seen.obstacles) {
        obstacle.weight = look_weight;
      }
      map->add(seen, grid_, pose);
    });
  };
  const int full = looksOfWeight(1.0);
  const int ramp = looksOfWeight(0.25);
  EXPECT_LT(full, 6);
  EXPECT_GE(ramp, 3 * full);
  EXPECT_LT(ramp, 30);
}

TEST_F(ObstacleMapLooksTest, UncertainLooksMarkMoreCellsMoreSlowly) {
  const auto looksOfSigma = [&](double sigma_m) {
    CameraObstacles seen = makeLook("left", 0.9, 0.0F);
    seen.obstacles = {makeObstacle(grid_.rayOf(0.5 * M_PI), 3.02, sigma_m)};
    return looksUntilOccupied([&](int number, LocalObstacleMap* map) {
      const RigidTransform pose = RigidTransform::planar(0.1 * number, 0.0, 0.0);
      seen.origin_m.x() = 1.9 - 0.1 * number;  // the camera sees the same place from the same place
      map->moveTo(stamp_, RigidTransform());
      map->add(seen, grid_, pose);
      seen.camera_name = std::to_string(number);  // each look counts in full
    });
  };
  const int sure = looksOfSigma(0.03);
  const int unsure = looksOfSigma(0.3);
  EXPECT_LT(sure, 8);
  EXPECT_GT(unsure, 3 * sure);
}

TEST_F(ObstacleMapLooksTest, RangesAlongTheTravelAreUncertain) {
  const auto sigmaAt = [&](double angle_rad) {
    LocalObstacleMap map;
    CameraObstacles seen = makeLook("front", 0.6, 0.0F);
    seen.obstacles = {makeObstacle(grid_.rayOf(angle_rad), 3.0, 0.02)};
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

}  // namespace
}  // namespace vcharge
