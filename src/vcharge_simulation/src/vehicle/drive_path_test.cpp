#include "vcharge_simulation/vehicle/drive_path.h"
#include "vcharge_core/motion/vehicle_rates.h"

#include <cmath>

#include <gtest/gtest.h>

namespace vcharge {
namespace {

constexpr double kPi = 3.14159265358979323846;

TEST(ArcMotionTest, FollowsTheCircle) {
  for (const double radius_m : {-8.0, 3.0, 50.0}) {
    for (const double turn_rad : {0.01, 0.5, 2.0}) {
      const double signed_turn = radius_m < 0.0 ? -turn_rad : turn_rad;
      const RigidTransform motion = arcMotion(radius_m * signed_turn, signed_turn);
      EXPECT_NEAR(motion.translation().x(), radius_m * std::sin(signed_turn), 1e-12);
      EXPECT_NEAR(motion.translation().y(), radius_m * (1.0 - std::cos(signed_turn)), 1e-12);
      EXPECT_NEAR(yawOfRotation(motion.rotation()), signed_turn, 1e-12);
    }
  }
}

TEST(ArcMotionTest, IsAStraightLineWithoutTurn) {
  EXPECT_LT((arcMotion(2.5, 0.0).translation() - Eigen::Vector3d(2.5, 0.0, 0.0)).norm(), 1e-15);
}

TEST(ArcMotionTest, ComposesAlongOneCircle) {
  const RigidTransform twice = arcMotion(1.0, 0.3) * arcMotion(1.0, 0.3);
  EXPECT_LT((twice.translation() - arcMotion(2.0, 0.6).translation()).norm(), 1e-14);
}

TEST(DrivePathTest, ClosedPathReturnsToItsStart) {
  const DrivePath path =
      DrivePath::throughWaypoints({{20, -9}, {20, 9}, {-20, 9}, {-20, -9}}, true, 5.0, 3.0);
  EXPECT_NEAR(path.heading(path.length()), 2.0 * kPi, 1e-12);
  RigidTransform world_from_here = path.worldFromStart();
  constexpr int kSteps = 100000;
  for (int i = 0; i < kSteps; ++i) {
    const double from = path.length() * i / kSteps;
    const double to = path.length() * (i + 1) / kSteps;
    world_from_here = world_from_here * arcMotion(to - from, path.heading(to) - path.heading(from));
  }
  EXPECT_LT((world_from_here.translation() - path.worldFromStart().translation()).norm(), 1e-4);
}

TEST(DrivePathTest, CurvatureIsContinuousAndTheSlopeOfTheHeading) {
  const DrivePath path = DrivePath::throughWaypoints({{0, 0}, {20, 0}, {20, 20}}, false, 5.0, 3.0);
  for (double s = 0.5; s < path.length() - 0.5; s += 0.1) {
    EXPECT_LT(std::abs(path.curvature(s + 1e-3) - path.curvature(s)), 1e-3 * (0.2 / 3.0) * 1.01);
    EXPECT_NEAR((path.heading(s + 1e-4) - path.heading(s - 1e-4)) / 2e-4, path.curvature(s), 1e-5);
  }
}

TEST(DrivePathTest, RejectsEdgesTooShortForTheirCorners) {
  EXPECT_THROW(DrivePath::throughWaypoints({{0, 0}, {3, 0}, {3, 20}}, false, 5.0, 3.0),
               std::invalid_argument);
}

}  // namespace
}  // namespace vcharge
