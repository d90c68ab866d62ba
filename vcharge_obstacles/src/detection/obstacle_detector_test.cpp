#include "vcharge_obstacles/obstacle_detector.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

#include <gtest/gtest.h>

#include "detection/box_world.h"
#include "detection/polar_obstacles.h"
#include "vcharge_core/camera/ray_table.h"

namespace vcharge {
namespace {

constexpr double kDegree = M_PI / 180.0;

class ObstacleDetectorTest : public ::testing::Test {
 protected:
  CameraObstacles detect(const BoxWorld& world, const std::string& name, const RigidTransform& pose = {},
                         const BoxWorldNoise& noise = {}) const {
    const RigCamera& camera = rig_.cameras[rig_.cameraIndex(name)];
    const RangeMap map = measureBoxWorld(world, camera, pose, Timestamp(), noise);
    return detectIn(map, camera);
  }
  CameraObstacles detectIn(const RangeMap& map, const RigCamera& camera) const {
    return ObstacleDetector(rebuildWorkingCamera(map.camera, map.range_m.size(), camera),
                            *camera.vehicle_from_camera, VehicleFootprint().outline(), options_)
        .detect(map);
  }
  /// Index of the scan's ray in a direction from the camera.
  static size_t rayTo(const CameraObstacles& seen, double angle_rad) {
    return static_cast<size_t>(
        std::lround((angle_rad - seen.scan.angle_min_rad) / seen.scan.angle_increment_rad));
  }
  static int countObstacles(const CameraObstacles& seen) {
    return static_cast<int>(std::count_if(seen.scan.range_m.begin(), seen.scan.range_m.end(),
                                          [](float range) { return std::isfinite(range); }));
  }

  const CameraRig rig_ = makeBoxWorldRig();
  ObstacleDetectorOptions options_;
};

TEST_F(ObstacleDetectorTest, BareGroundIsFreeAndHasNoObstacle) {
  const CameraObstacles seen = detect({}, "left", {}, {0.01, 0.1, 5});
  EXPECT_EQ(seen.ground.state, GroundState::kMeasured);
  EXPECT_EQ(countObstacles(seen), 0);
  EXPECT_GT(seen.scan.free_m[rayTo(seen, 0.5 * M_PI)], 4.0F);
}

TEST_F(ObstacleDetectorTest, FarObstaclesAtTheRimOfTheImageOnlyHideGround) {
  // A wall along the vehicle, from the middle of the left image to its rim.
  const BoxWorld world{{{{-20.0, 2.98, 0.0}, {20.0, 3.2, 0.8}}}};
  const CameraObstacles seen = detect(world, "left", {}, {0.01, 0.1, 7});
  int marking = 0;
  int hiding = 0;
  for (const PolarObstacle& obstacle : seen.obstacles) {
    const double off_axis_rad = std::abs(seen.scan.angle_rad(static_cast<size_t>(obstacle.ray)) - 0.5 * M_PI);
    const bool expected =
        off_axis_rad > options_.max_off_axis_rad && obstacle.range_m > ObstacleDetector::kMaxOffAxisRange_m;
    EXPECT_EQ(obstacle.is_off_axis, expected) << off_axis_rad << " " << obstacle.range_m;
    ++(expected ? hiding : marking);
  }
  EXPECT_GT(marking, 90);
  EXPECT_GT(hiding, 10);
  ASSERT_EQ(seen.free_to_m.size(), seen.scan.range_m.size());
  for (size_t ray = 0; ray < seen.free_to_m.size(); ++ray) {
    const double off_axis_rad = std::abs(std::remainder(seen.scan.angle_rad(ray) - 0.5 * M_PI, 2.0 * M_PI));
    EXPECT_EQ(seen.free_to_m[ray], off_axis_rad > options_.max_off_axis_rad
                                       ? ObstacleDetector::kMaxOffAxisFree_m
                                       : std::numeric_limits<double>::infinity());
  }
  const BoxWorld near_box{{{{3.9, 1.2, 0.0}, {4.3, 1.6, 0.8}}}};  // beside the bumper, at the rim
  const CameraObstacles near_seen = detect(near_box, "left", {}, {0.01, 0.1, 7});
  ASSERT_FALSE(near_seen.obstacles.empty());
  EXPECT_FALSE(near_seen.obstacles.front().is_off_axis);
}

TEST_F(ObstacleDetectorTest, WallIsReportedAtItsRangeWithItsHeight) {
  for (const double distance_m : {1.0, 2.0, 4.0}) {
    const double wall_y = 0.98 + distance_m;
    const BoxWorld world{{{{-20.0, wall_y, 0.0}, {20.0, wall_y + 0.3, 0.8}}}};
    const CameraObstacles seen = detect(world, "left", {}, {0.01, 0.1, 7});
    for (const double angle_rad : {0.3 * M_PI, 0.5 * M_PI, 0.7 * M_PI}) {
      const size_t ray = rayTo(seen, angle_rad);
      const double expected_m = distance_m / std::sin(seen.scan.angle_rad(ray));
      EXPECT_NEAR(seen.scan.range_m[ray], expected_m, 0.02 * expected_m + 0.01) << distance_m;
      EXPECT_NEAR(seen.scan.height_m[ray], 0.8, 0.15) << distance_m;
      EXPECT_LT(seen.scan.free_m[ray], expected_m);
      EXPECT_GT(seen.scan.free_m[ray], 0.6 * expected_m);
    }
  }
}

TEST_F(ObstacleDetectorTest, WhatHangsHigherThanTheVehicleIsNoObstacleDespiteShortRanges) {
  const RigCamera& camera = rig_.cameras[rig_.cameraIndex("front")];
  const auto countBelow = [&](double bottom_m) {
    const BoxWorld board{{{{9.7, -1.5, bottom_m}, {9.8, 1.5, bottom_m + 0.28}}}};
    RangeMap map = measureBoxWorld(board, camera, {}, Timestamp(), {0.01, 0.0, 3});
    const RayTable rays(map.camera, map.range_m.size(), 2.0 * M_PI);
    for (int y = 0; y < map.range_m.rows; ++y) {
      for (int x = 0; x < map.range_m.cols; ++x) {
        const Eigen::Vector3d ray = camera.vehicle_from_camera->rotation() * rays.ray(x, y).cast<double>();
        map.range_m.at<float>(y, x) *= ray.z() > 0.0 ? 0.9F : 1.0F;
      }
    }
    return countObstacles(detectIn(map, camera));
  };
  EXPECT_EQ(countBelow(2.14), 0);  // seen 1.99 m up
  EXPECT_GT(countBelow(1.5), 10);
}

TEST_F(ObstacleDetectorTest, KerbIsReportedWithItsHeight) {
  const BoxWorld world{{{{-20.0, 2.5, 0.0}, {20.0, 3.2, 0.12}}}};
  const CameraObstacles seen = detect(world, "left", {}, {0.005, 0.0, 3});
  const size_t ray = rayTo(seen, 0.5 * M_PI);
  EXPECT_NEAR(seen.scan.range_m[ray], 1.52, 0.1);
  EXPECT_NEAR(seen.scan.height_m[ray], 0.12, 0.03);
}

/// Obstacles on a ray, nearest first.
std::vector<PolarObstacle> onRay(const CameraObstacles& seen, size_t ray) {
  std::vector<PolarObstacle> found;
  std::copy_if(seen.obstacles.begin(), seen.obstacles.end(), std::back_inserter(found),
               [&](const PolarObstacle& obstacle) { return static_cast<size_t>(obstacle.ray) == ray; });
  return found;
}

TEST_F(ObstacleDetectorTest, HighObstaclesAreWeightedByTheLogOddsOfTheirConfidence) {
  const BoxWorld wall{{{{-20.0, 2.98, 0.0}, {20.0, 3.2, 0.8}}}};
  const BoxWorld kerb{{{{-20.0, 2.5, 0.0}, {20.0, 3.2, 0.12}}}};
  const RigCamera& camera = rig_.cameras[rig_.cameraIndex("left")];
  const auto weightAt = [&](const BoxWorld& world, double confidence) {
    RangeMap map = measureBoxWorld(world, camera, {}, Timestamp(), {0.005, 0.0, 3});
    map.confidence.setTo(confidence, map.confidence > 0.0);
    const CameraObstacles seen = detectIn(map, camera);
    const std::vector<PolarObstacle> found = onRay(seen, rayTo(seen, 0.5 * M_PI));
    return found.empty() ? -1.0 : found.front().weight;
  };
  EXPECT_NEAR(weightAt(wall, 0.95), 1.0, 1e-6);
  EXPECT_NEAR(weightAt(wall, 0.75), std::log(3.0) / std::log(9.0), 1e-3);
  EXPECT_NEAR(weightAt(wall, 0.45), 0.0,
              1e-6);  // the obstacle is probably wrong, but hides the ground behind it
  EXPECT_NEAR(weightAt(wall, 0.85), std::log(0.85 / 0.15) / std::log(9.0), 1e-3);
  EXPECT_NEAR(weightAt(kerb, 0.85), 1.0, 1e-6);
}

TEST_F(ObstacleDetectorTest, GroundAboveWhichTheImageEndsIsNotFree) {
  const PolarGrid grid(options_.grid);
  // Bare ground to the left of the left camera; the image is masked for rays that fall by less than this per
  // metre of range.
  const auto freeFraction = [&](double fall, double range_m) {
    RigCamera camera = rig_.cameras[rig_.cameraIndex("left")];
    const RayTable rays(camera.model, camera.image_size_px, 2.0 * M_PI, camera.mask);
    camera.mask = cv::Mat(camera.image_size_px, CV_8UC1, cv::Scalar(255));
    for (int y = 0; y < camera.mask.rows; ++y) {
      for (int x = 0; x < camera.mask.cols; ++x) {
        const Eigen::Vector3d ray = camera.vehicle_from_camera->rotation() * rays.ray(x, y).cast<double>();
        if (ray.z() > -fall * ray.head<2>().norm()) {
          camera.mask.at<uint8_t>(y, x) = 0;
        }
      }
    }
    const CameraObstacles seen = detectIn(measureBoxWorld({}, camera, {}, Timestamp()), camera);
    const int bin = grid.binOfInverse(static_cast<float>(1.0 / range_m));
    return seen.free_fraction[grid.index(grid.rayOf(0.5 * M_PI), bin)];
  };
  EXPECT_GT(freeFraction(-1.0, 3.6), 0.5F);  // not masked
  // At 0.9 m camera height, a ray that falls by 0.2 is 0.25 m high at 3.25 m and meets the ground at 4.5 m.
  EXPECT_GT(freeFraction(0.2, 2.9), 0.5F);
  EXPECT_EQ(freeFraction(0.2, 3.6), 0.0F);
  // Nearby ground is free, because another camera would observe a body there: 0.25 m at 1.6 m, ground at 2.25
  // m.
  EXPECT_GT(freeFraction(0.4, 2.0), 0.5F);
}

TEST_F(ObstacleDetectorTest, RampOfRangesUpToAWallHasALowWeight) {
  // A ramp that rises from 9 to 25 cm within 0.8 m in steps of 1 cm: a slope of 0.2.
  BoxWorld world{{{{-20.0, 3.2, 0.0}, {20.0, 3.4, 1.2}}}};
  for (int step = 0; step <= 16; ++step) {
    world.boxes.push_back({{-20.0, 2.4 + 0.05 * step, 0.0}, {20.0, 3.2, 0.09 + 0.01 * step}});
  }
  const CameraObstacles seen = detect(world, "left", {}, {0.005, 0.0, 3});
  const std::vector<PolarObstacle> found = onRay(seen, rayTo(seen, 0.5 * M_PI));
  ASSERT_GE(found.size(), 2U);
  EXPECT_LT(found.front().height_m, 0.3);
  EXPECT_TRUE(found.front().is_ramp);
  EXPECT_EQ(found.front().weight, kRampWeight);
  EXPECT_GT(found.back().height_m, 0.8);
  EXPECT_FALSE(found.back().is_ramp);
  EXPECT_EQ(found.back().weight, 1.0);
}

TEST_F(ObstacleDetectorTest, LowObstaclesInFrontOfAWallAreNoRamps) {
  const WorldBox wall{{-20.0, 3.4, 0.0}, {20.0, 3.6, 1.2}};
  const WorldBox pavement{{1.0, 2.4, 0.0}, {2.8, 3.4, 0.12}};  // no gap, but a flat top
  const WorldBox box{{-20.0, 2.4, 0.0}, {20.0, 2.5, 0.25}};    // as high as a ramp, but with a gap
  for (const WorldBox& low : {pavement, box}) {
    const CameraObstacles seen = detect({{wall, low}}, "left", {}, {0.005, 0.0, 3});
    const std::vector<PolarObstacle> found = onRay(seen, rayTo(seen, 0.5 * M_PI));
    ASSERT_FALSE(found.empty());
    EXPECT_NEAR(found.front().range_m, 1.42, 0.15);
    EXPECT_LT(found.front().height_m, 0.3);
    EXPECT_FALSE(found.front().is_ramp) << low.max_m.z();
  }
}

TEST_F(ObstacleDetectorTest, SurfaceBelowTheMinimumHeightIsGround) {
  const BoxWorld world{{{{-20.0, 2.5, 0.0}, {20.0, 3.2, 0.04}}}};
  EXPECT_EQ(countObstacles(detect(world, "left")), 0);
}

TEST_F(ObstacleDetectorTest, ThinPostIsReported) {
  const BoxWorld world{{{{1.85, 3.0, 0.0}, {1.95, 3.1, 1.0}}}};
  const CameraObstacles seen = detect(world, "left", {}, {0.01, 0.1, 9});
  const size_t ray = rayTo(seen, 0.5 * M_PI);
  EXPECT_NEAR(seen.scan.range_m[ray], 2.02, 0.05);
}

TEST_F(ObstacleDetectorTest, LowBarIsAnObstacleAndAPortalIsNot) {
  const BoxWorld bar{{{{-1.0, 2.5, 0.4}, {5.0, 2.57, 0.47}}}};
  EXPECT_NEAR(detect(bar, "left").scan.range_m[rayTo(detect(bar, "left"), 0.5 * M_PI)], 1.52, 0.05);
  const BoxWorld portal{{{{-1.0, 2.5, 2.3}, {5.0, 2.7, 2.6}}}};
  EXPECT_EQ(countObstacles(detect(portal, "left")), 0);
}

TEST_F(ObstacleDetectorTest, PitchOfTheBodyIsCorrected) {
  const BoxWorld world{{{{-20.0, 3.98, 0.0}, {20.0, 4.2, 0.6}}}};
  for (const double pitch_rad : {-1.0 * kDegree, 1.0 * kDegree}) {
    const RigidTransform pose(rotationFromYawPitchRoll(0.0, pitch_rad, 0.0), Eigen::Vector3d::Zero());
    const CameraObstacles seen = detect(world, "left", pose, {0.01, 0.0, 4});
    EXPECT_NEAR(seen.ground.pitch_rad(), pitch_rad, 0.1 * kDegree);
    const size_t ray = rayTo(seen, 0.5 * M_PI);
    EXPECT_NEAR(seen.scan.range_m[ray], 3.0, 0.08);
    EXPECT_NEAR(seen.scan.height_m[ray], 0.6, 0.1);
    EXPECT_EQ(countObstacles(detect({}, "front", pose, {0.01, 0.0, 4})), 0);
  }
}

TEST_F(ObstacleDetectorTest, GroundTiltedByThreeDegreesIsReportedAndClearsNothing) {
  const BoxWorld world{{{{-20.0, 3.0, 0.0}, {20.0, 3.3, 1.5}}}};
  for (const double roll_rad : {-3.0 * kDegree, 3.0 * kDegree}) {
    const RigidTransform pose(rotationFromYawPitchRoll(0.0, 0.0, roll_rad), Eigen::Vector3d::Zero());
    const CameraObstacles seen = detect(world, "left", pose, {0.01, 0.0, 4});
    EXPECT_EQ(seen.ground.state, GroundState::kOutOfBounds);
    EXPECT_EQ(*std::max_element(seen.free_fraction.begin(), seen.free_fraction.end()), 0.0F);
    // A wall remains an obstacle, ground does not.
    EXPECT_NEAR(seen.scan.range_m[rayTo(seen, 0.5 * M_PI)], 2.02, 0.1);
    EXPECT_EQ(countObstacles(detect({}, "left", pose)), 0);
  }
}

TEST_F(ObstacleDetectorTest, UnknownRangesAreNeitherFreeNorOccupied) {
  const RigCamera& camera = rig_.cameras[rig_.cameraIndex("left")];
  RangeMap night = measureBoxWorld({}, camera, {}, Timestamp());
  night.range_m.setTo(std::numeric_limits<float>::quiet_NaN());
  night.standard_deviation_m.setTo(std::numeric_limits<float>::quiet_NaN());
  night.confidence.setTo(0.0);
  const CameraObstacles seen = detectIn(night, camera);
  EXPECT_EQ(seen.known_fraction, 0.0);
  EXPECT_EQ(seen.ground.state, GroundState::kFewPoints);
  EXPECT_EQ(*std::max_element(seen.free_fraction.begin(), seen.free_fraction.end()), 0.0F);
  EXPECT_EQ(countObstacles(seen), 0);
}

TEST_F(ObstacleDetectorTest, SkyAndFarWallsClearNothing) {
  // In the left half of the image only far surfaces have a range.
  const RigCamera& camera = rig_.cameras[rig_.cameraIndex("left")];
  const BoxWorld world{{{{-30.0, 12.5, 0.0}, {30.0, 13.0, 8.0}}}};
  RangeMap map = measureBoxWorld(world, camera, {}, Timestamp());
  for (int row = 0; row < map.range_m.rows; ++row) {
    for (int column = 0; column < map.range_m.cols / 2; ++column) {
      float& range_m = map.range_m.at<float>(row, column);
      range_m = range_m > 9.0F ? range_m : std::numeric_limits<float>::quiet_NaN();
    }
  }
  const CameraObstacles seen = detectIn(map, camera);
  ASSERT_EQ(seen.ground.state, GroundState::kMeasured);
  const size_t unknown_ray = rayTo(seen, 0.35 * M_PI);  // the left columns show the forward side
  const size_t known_ray = rayTo(seen, 0.65 * M_PI);
  EXPECT_GT(std::max(seen.scan.free_m[unknown_ray], seen.scan.free_m[known_ray]), 3.0F);
  EXPECT_EQ(std::min(seen.scan.free_m[unknown_ray], seen.scan.free_m[known_ray]), 0.0F);
}

TEST_F(ObstacleDetectorTest, DirtOnTheLensWithFarRangesIsNotGround) {
  // Dirt has no parallax and gets the largest ranges; on descending rays these lie below the ground.
  const RigCamera& camera = rig_.cameras[rig_.cameraIndex("left")];
  RangeMap map = measureBoxWorld({}, camera, {}, Timestamp());
  map.range_m.rowRange(80, 88).setTo(40.0F);
  map.standard_deviation_m.rowRange(80, 88).setTo(0.5F);
  const CameraObstacles dirty = detectIn(map, camera);
  const CameraObstacles clean = detect({}, "left");
  EXPECT_EQ(countObstacles(dirty), 0);
  double more = 0.0;
  double less = 0.0;
  for (size_t i = 0; i < clean.free_fraction.size(); ++i) {
    more = std::max<double>(more, dirty.free_fraction[i] - clean.free_fraction[i]);
    less = std::max<double>(less, clean.free_fraction[i] - dirty.free_fraction[i]);
  }
  EXPECT_LT(more, 0.01);
  EXPECT_GT(less, 0.5);
}

TEST_F(ObstacleDetectorTest, CameraBelowTheReferenceObstacleIsRefused) {
  RigCamera camera = rig_.cameras[0];
  camera.vehicle_from_camera = RigidTransform(camera.vehicle_from_camera->rotation(), {3.6, 0.0, 0.2});
  const RangeMap map = measureBoxWorld({}, rig_.cameras[0], {}, Timestamp());
  EXPECT_THROW(detectIn(map, camera), std::invalid_argument);
}

TEST_F(ObstacleDetectorTest, OptionsNameTheField) {
  options_.min_height_m = 0.3;
  try {
    options_.validate();
    ADD_FAILURE();
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("min_height_m"), std::string::npos);
  }
}

}  // namespace
}  // namespace vcharge
