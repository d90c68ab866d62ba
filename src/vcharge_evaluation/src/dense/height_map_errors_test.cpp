#include "vcharge_evaluation/height_map_errors.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "vcharge_core/base/error.h"

namespace vcharge {
namespace {

constexpr double kKerb_m = 0.12;
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

/// Sets the height of the cells whose centres meet a condition.
template <class Condition>
void setHeights(HeightMap* map, float height_m, const Condition& isChosen) {
  for (int row = 0; row < map->height_m.rows; ++row) {
    for (int column = 0; column < map->height_m.cols; ++column) {
      if (isChosen(map->centreOf(column, row))) {
        map->height_m.at<float>(row, column) = height_m;
      }
    }
  }
}

/// Ground with a platform as high as a kerb from x = 3 to 4 m, and a wall of 2 m from y = 2.5 m on.
HeightMap world(double cell_size_m) {
  HeightMap map;
  map.frame_id = "world";
  map.cell_size_m = cell_size_m;
  map.origin_m = {-2.0 + 0.5 * cell_size_m, -3.0 + 0.5 * cell_size_m};
  map.height_m = cv::Mat(static_cast<int>(std::lround(6.0 / cell_size_m)),
                         static_cast<int>(std::lround(10.0 / cell_size_m)), CV_32FC1, cv::Scalar(0.0));
  setHeights(&map, kKerb_m, [](const Eigen::Vector2d& at) { return at.x() > 3.0 && at.x() < 4.0; });
  setHeights(&map, 2.0F, [](const Eigen::Vector2d& at) { return at.y() > 2.5; });
  return map;
}

/// The same with a pillar of 0.4 m at (x_m, -1.4).
HeightMap worldWithPillar(double cell_size_m, double x_m) {
  HeightMap map = world(cell_size_m);
  setHeights(&map, 2.0F, [&](const Eigen::Vector2d& at) {
    return std::abs(at.x() - x_m) < 0.2 && std::abs(at.y() + 1.4) < 0.2;
  });
  return map;
}

class HeightMapErrorsTest : public ::testing::Test {
 protected:
  void SetUp() override {
    for (const double yaw : {0.0, 1.57, -1.57}) {
      rig_.cameras.push_back(
          {"camera" + std::to_string(rig_.cameras.size()), "optical", cv::Size(200, 150),
           MeiCamera(1.1, 120.0, 120.0, 99.5, 74.5), 3.1, "", cv::Mat(),
           RigidTransform(rotationFromYawPitchRoll(yaw, 0.4, 0.0) * Eigen::Quaterniond(0.5, -0.5, 0.5, -0.5),
                          Eigen::Vector3d(0.0, 0.0, 1.0)),
           std::nullopt});
    }
    for (int i = 0; i < 12; ++i) {
      poses_.push_back(
          {Timestamp::fromNanoseconds(1000 + i), RigidTransform::planar(0.4 * i - 1.0, 0.0, 0.0)});
    }
  }
  HeightMapErrors evaluate(const HeightMap& map,
                           const RigidTransform& world_from_map = RigidTransform()) const {
    return evaluateHeightMap(map, world_from_map, world(0.025), poses_, rig_, everything_rigid_);
  }

  CameraRig rig_;
  Trajectory poses_;
  const IsRigid everything_rigid_ = makeIsRigid({});
};

TEST_F(HeightMapErrorsTest, PerfectMapHasNoErrors) {
  const HeightMapErrors errors = evaluate(world(0.05));
  EXPECT_GT(errors.num_seen, 10000U);
  EXPECT_EQ(errors.num_mapped, errors.num_seen);
  EXPECT_LT(errors.height_m.max, 1e-5);
  EXPECT_GT(errors.num_steps_found, 80U);
  EXPECT_EQ(errors.num_steps_found, errors.num_steps_mapped);
  EXPECT_LT(errors.step_position_m.max, 0.026);  // half a cell
  EXPECT_GT(errors.kerbs.size(), 50U);
  EXPECT_EQ(errors.kerbs.size(), errors.num_kerbs_seen);
  EXPECT_LT(errors.kerb_height_m.max, 1e-5);
  EXPECT_EQ(errors.measurements.size(), 20U);
  EXPECT_EQ(errors.num_measurements_missing, 0U);
  EXPECT_LT(errors.max_measurement_m, 0.051);
}

TEST_F(HeightMapErrorsTest, MapThatIsTooHighHasThatError) {
  HeightMap map = world(0.05);
  map.height_m += 0.07F;
  const HeightMapErrors errors = evaluate(map);
  EXPECT_NEAR(errors.height_m.mean, 0.07, 1e-5);
  EXPECT_NEAR(errors.mean_signed_m, 0.07, 1e-5);
  EXPECT_EQ(errors.fraction_within_10_cm, 1.0);
  EXPECT_LT(errors.kerb_height_m.max, 1e-5);  // heights of steps are unchanged
}

TEST_F(HeightMapErrorsTest, ShiftedStepsHaveThatError) {
  HeightMap map = world(0.05);
  map.origin_m.x() += 0.1;
  const HeightMapErrors errors = evaluate(map);
  double kerbs = 0.0;
  for (const TapeMeasurement& measurement : errors.measurements) {
    kerbs += measurement.kind == TapeMeasurement::Kind::kLength ? 1.0 : 0.0;
  }
  EXPECT_GT(kerbs, 0.0);
  EXPECT_NEAR(errors.step_position_m.max, 0.1, 0.026);
  EXPECT_GT(errors.step_position_m.mean, 0.03);  // the steps of the wall are not shifted
}

TEST_F(HeightMapErrorsTest, EdgesAreAtTheEndOfTheGroundNotBehindAGap) {
  // The outermost cells and the middle of the platform have no height, so that the cells between have ends
  // too.
  HeightMap map = world(0.05);
  setHeights(&map, kNan, [](const Eigen::Vector2d& at) {
    const double inside_m = 0.5 - std::abs(at.x() - 3.5);
    return inside_m > 0.0 && (inside_m < 0.05 || inside_m > 0.35);
  });
  int num_lengths = 0;
  for (const TapeMeasurement& measurement : evaluate(map).measurements) {
    if (measurement.kind == TapeMeasurement::Kind::kLength) {
      EXPECT_NEAR(measurement.map_m, measurement.truth_m, 0.051);
      ++num_lengths;
    }
  }
  EXPECT_GT(num_lengths, 0);
}

TEST_F(HeightMapErrorsTest, HighEdgesAreNotReadInFrontOfTheFirstHighCell) {
  // A pillar with faces at varying positions within the map's cells; the truth's cells are a fifth as large.
  for (const double offset_m : {0.0, 0.01, 0.02, 0.03, 0.04}) {
    const HeightMapErrors errors =
        evaluateHeightMap(worldWithPillar(0.05, 1.0 + offset_m), RigidTransform(),
                          worldWithPillar(0.01, 1.0 + offset_m), poses_, rig_, everything_rigid_);
    EXPECT_LT(errors.step_position_m.max, 0.036) << offset_m;  // half a cell and a sample
    EXPECT_GT(errors.step_position_m.count, 50U);
  }
}

TEST_F(HeightMapErrorsTest, DrivableGridIsJudgedAtTheWall) {
  const HeightMapErrors perfect = evaluate(world(0.05));
  EXPECT_GT(perfect.drivability.num_faces, 50U);
  EXPECT_EQ(perfect.drivability.num_faces_blocked, perfect.drivability.num_faces);
  EXPECT_EQ(perfect.drivability.num_solid, 0U);
  // Without a height the wall is unobserved until it is solid. The platform is removed as well.
  HeightMap map = world(0.05);
  const cv::Mat is_wall = map.height_m > 1.0F;
  map.height_m.setTo(0.0F);
  map.height_m.setTo(kNan, is_wall);
  HeightMapErrors errors = evaluate(map);
  EXPECT_EQ(errors.drivability.num_faces, perfect.drivability.num_faces);
  EXPECT_EQ(errors.drivability.num_faces_blocked, 0U);
  EXPECT_EQ(errors.drivability.open_faces.size(), 0U);
  map.solid = is_wall.clone();
  map.solid.at<uint8_t>(20, 20) = 1;  // open ground
  map.height_m.at<float>(20, 20) = kNan;
  errors = evaluate(map);
  EXPECT_EQ(errors.drivability.num_faces_blocked, perfect.drivability.num_faces);
  EXPECT_EQ(errors.drivability.num_solid, static_cast<size_t>(cv::countNonZero(is_wall)) + 1);
  EXPECT_EQ(errors.drivability.num_solid_on_ground, 1U);
  // A map with ground instead of the wall has open faces.
  map.solid = cv::Mat();
  map.height_m.setTo(0.0F);
  EXPECT_EQ(evaluate(map).drivability.open_faces.size(), perfect.drivability.num_faces);
}

TEST_F(HeightMapErrorsTest, MapOfAnotherFrameIsAligned) {
  // The map's frame is shifted and turned by 180 degrees, which keeps its cells on the grid.
  const RigidTransform world_from_map(rotationFromYawPitchRoll(M_PI, 0.0, 0.0),
                                      Eigen::Vector3d(7.0, 1.0, 0.3));
  HeightMap map = world(0.05);
  cv::flip(map.height_m, map.height_m, -1);
  map.height_m -= 0.3F;
  const HeightMap upright = world(0.05);
  const Eigen::Vector2d last = upright.centreOf(upright.height_m.cols - 1, upright.height_m.rows - 1);
  map.origin_m = (world_from_map.inverse() * Eigen::Vector3d(last.x(), last.y(), 0.0)).head<2>();
  Trajectory in_map = poses_;
  for (StampedTransform& pose : in_map) {
    pose.world_from_vehicle = world_from_map.inverse() * pose.world_from_vehicle;
  }
  const RigidTransform aligned = alignToTruth(in_map, poses_);  // from a straight drive
  EXPECT_LT((aligned.translation() - world_from_map.translation()).norm(), 1e-6);
  const HeightMapErrors errors = evaluate(map, aligned);
  EXPECT_GT(errors.num_mapped, 10000U);
  EXPECT_LT(errors.height_m.max, 1e-4);
}

TEST_F(HeightMapErrorsTest, UnmappedCellsAreCountedAndNotJudged) {
  HeightMap map = world(0.05);
  map.height_m.colRange(0, 100).setTo(kNan);
  const HeightMapErrors errors = evaluate(map);
  EXPECT_LT(errors.num_mapped, errors.num_seen);
  EXPECT_GT(errors.num_mapped, 1000U);
  EXPECT_LT(errors.height_m.max, 1e-5);
  EXPECT_LT(errors.num_steps_mapped, errors.num_steps);
}

TEST_F(HeightMapErrorsTest, DistanceOfTheNearestViewOfAKerbIsGiven) {
  const HeightMapErrors errors = evaluate(world(0.05));
  for (const KerbError& kerb : errors.kerbs) {
    // The cameras move along y = 0 from x = -1 to 3.4 m, 1 m above the ground, and see both sides.
    const double beside = std::hypot(kerb.position_m.y(), 1.0 - kKerb_m);
    EXPECT_GT(kerb.nearest_view_m, beside - 1e-6);
    EXPECT_LT(kerb.nearest_view_m, beside + 1.5);
  }
}

TEST_F(HeightMapErrorsTest, TapeMeasurementsDoNotDependOnTheMap) {
  const HeightMapErrors perfect = evaluate(world(0.05));
  HeightMap map = world(0.05);
  map.height_m.colRange(50, 120).setTo(kNan);
  const HeightMapErrors errors = evaluate(map);
  ASSERT_EQ(errors.measurements.size(), perfect.measurements.size());
  for (size_t i = 0; i < errors.measurements.size(); ++i) {
    EXPECT_EQ(errors.measurements[i].from_m, perfect.measurements[i].from_m);
    EXPECT_EQ(errors.measurements[i].to_m, perfect.measurements[i].to_m);
  }
  EXPECT_GT(errors.num_measurements_missing, 5U);
  EXPECT_LT(errors.max_measurement_m, 0.051);
}

TEST_F(HeightMapErrorsTest, PlantsAndGrassOnAnIslandAreNotRigid) {
  const auto rectangle = [](double x0, double y0, double x1, double y1) {
    return std::vector<Eigen::Vector2d>{{x0, y0}, {x1, y0}, {x1, y1}, {x0, y1}};
  };
  const IsRigid is_rigid = makeIsRigid({{"kerb", rectangle(0, 0, 4, 4), 0.0, kKerb_m},
                                        {"car", rectangle(10, 0, 14, 2), 0.0, 1.4},
                                        {"hedge", rectangle(1, 3, 3, 3.5), kKerb_m, 1.0},
                                        {"tree", rectangle(12, 5, 12.2, 5.2), 0.0, 1.8}});
  EXPECT_TRUE(is_rigid({0.05, 1.0}, kKerb_m + 0.01));
  EXPECT_FALSE(is_rigid({2.0, 1.0}, 0.25));  // grass
  EXPECT_FALSE(is_rigid({2.0, 3.2}, 1.0));
  EXPECT_FALSE(is_rigid({0.8, 3.2}, kKerb_m));  // overhanging leaves
  EXPECT_TRUE(is_rigid({10.05, 1.0}, 0.9));
  EXPECT_TRUE(is_rigid({20.0, 1.0}, 2.0));   // a wall
  EXPECT_FALSE(is_rigid({14.0, 6.0}, 2.5));  // in the crown of the tree, whose footprint is the stem
  EXPECT_TRUE(is_rigid({14.0, 6.0}, 0.2));   // below it
  EXPECT_TRUE(is_rigid({12.0, 1.95}, 1.4));  // the car under it
  EXPECT_TRUE(is_rigid({16.0, 6.0}, 2.5));   // beside it

  // Half of the platform belongs to a hedge.
  const HeightMapErrors errors =
      evaluateHeightMap(world(0.05), RigidTransform(), world(0.025), poses_, rig_,
                        makeIsRigid({{"hedge", rectangle(3, 0, 4, 2.4), 0.0, kKerb_m}}));
  EXPECT_GT(errors.measurements.size(), 8U);  // half of the scene has no room for 20
  for (const TapeMeasurement& measurement : errors.measurements) {
    EXPECT_TRUE(measurement.from_m.y() < 0.0 || measurement.from_m.y() > 2.3)
        << measurement.from_m.transpose();
  }
}

TEST_F(HeightMapErrorsTest, HiddenBackOfAnObjectIsNotMeasured) {
  // A pillar beside the path along y = 0: the ground behind it is visible at an angle, its back never.
  const HeightMap truth = worldWithPillar(0.025, 1.0);
  HeightMapErrorOptions options;
  options.num_measurements = 60;
  const HeightMapErrors errors =
      evaluateHeightMap(truth, RigidTransform(), truth, poses_, rig_, everything_rigid_, options);
  const auto isAt = [](const Eigen::Vector2d& position, double y) {
    return std::abs(position.x() - 1.0) < 0.2 && std::abs(position.y() - y) < 0.03;
  };
  size_t at_front = 0;
  for (const TapeMeasurement& measurement : errors.measurements) {
    EXPECT_FALSE(isAt(measurement.from_m, -1.6) || isAt(measurement.to_m, -1.6))
        << measurement.from_m.transpose() << " to " << measurement.to_m.transpose();
    at_front += isAt(measurement.from_m, -1.2) || isAt(measurement.to_m, -1.2) ? 1 : 0;
  }
  EXPECT_GT(at_front, 0U);
}

TEST_F(HeightMapErrorsTest, WallIsLocatedAtTheEndOfTheMap) {
  HeightMap map = world(0.05);
  setHeights(&map, kNan, [](const Eigen::Vector2d& at) { return at.y() > 2.5; });
  // Lengths between the platform and the wall end where the map ends.
  HeightMapErrorOptions options;
  options.num_measurements = 60;
  const HeightMapErrors errors =
      evaluateHeightMap(map, RigidTransform(), world(0.025), poses_, rig_, everything_rigid_, options);
  EXPECT_LT(errors.max_measurement_m, 0.051);
  EXPECT_EQ(errors.num_measurements_missing, 0U);
}

TEST_F(HeightMapErrorsTest, SurfaceBehindTheWallIsNotJudged) {
  HeightMap map = world(0.05);
  const HeightMapErrors errors = evaluate(map);
  for (int row = 0; row < map.height_m.rows; ++row) {
    for (int column = 0; column < map.height_m.cols; ++column) {
      if (map.centreOf(column, row).y() > 2.6) {
        ASSERT_TRUE(std::isnan(errors.error_m.at<float>(row, column)));
      }
    }
  }
}

TEST_F(HeightMapErrorsTest, TrajectoriesWithoutCommonTimeAreRefused) {
  Trajectory other = poses_;
  for (StampedTransform& pose : other) {
    pose.stamp = Timestamp::fromNanoseconds(pose.stamp.nanoseconds() + 5000000000);
  }
  EXPECT_THROW(alignToTruth(other, poses_), InputError);
}

}  // namespace
}  // namespace vcharge
