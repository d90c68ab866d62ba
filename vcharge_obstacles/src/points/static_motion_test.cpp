#include "points/static_motion.h"

#include <cmath>

#include <gtest/gtest.h>

namespace vcharge {
namespace {

const RigidTransform kBeforeFromNow(rotationFromVector({0.01, -0.02, 0.015}),
                                    Eigen::Vector3d(0.1, 0.02, 0.3));

FollowedPoint follow(const Eigen::Vector3d& now, const Eigen::Vector3d& motion,
                     const RigidTransform& before_from_now) {
  return {now.normalized(), (before_from_now * now - motion).normalized()};
}

TEST(StaticMotionTest, StaticPointsHaveNoResidualAndTheirInverseRange) {
  for (const Eigen::Vector3d& point :
       {Eigen::Vector3d(1.0, -0.5, 3.0), Eigen::Vector3d(-2.0, 0.4, 0.3), Eigen::Vector3d(0.0, 0.6, 8.0)}) {
    const StaticResidual found =
        compareWithStatic(follow(point, Eigen::Vector3d::Zero(), kBeforeFromNow), kBeforeFromNow, 0.0, 3.0);
    ASSERT_TRUE(found.is_valid);
    EXPECT_NEAR(found.residual_rad.norm(), 0.0, 1e-9);
    EXPECT_NEAR(found.inverse_range_per_m, 1.0 / point.norm(), 1e-6);
    EXPECT_NEAR(found.normal.norm(), 1.0, 1e-9);
  }
}

TEST(StaticMotionTest, MotionAcrossTheEpipolarPlaneIsTheResidual) {
  const Eigen::Vector3d point(0.5, 0.2, 4.0);
  const RigidTransform forwards(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0.0, 0.0, 0.3));
  // A line through the axis and the point's direction: motion perpendicular to both leaves it.
  const Eigen::Vector3d across = Eigen::Vector3d::UnitZ().cross(point).normalized();
  const StaticResidual found = compareWithStatic(follow(point, 0.2 * across, forwards), forwards, 0.0, 3.0);
  EXPECT_NEAR(found.residual_rad.norm(), 0.2 / (point + Eigen::Vector3d(0, 0, 0.3)).norm(), 0.003);
}

TEST(StaticMotionTest, PointBeyondTheGroundIsNotStatic) {
  const Eigen::Vector3d point(1.0, 0.5, 2.0);
  const RigidTransform aside(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0.5, 0.0, 0.0));
  const FollowedPoint followed = follow(point, Eigen::Vector3d::Zero(), aside);
  const double inverse = 1.0 / point.norm();
  EXPECT_NEAR(compareWithStatic(followed, aside, 0.9 * inverse, 3.0).residual_rad.norm(), 0.0, 1e-9);
  const StaticResidual beyond = compareWithStatic(followed, aside, 1.5 * inverse, 3.0);
  EXPECT_GT(beyond.residual_rad.norm(), 0.02);
  EXPECT_EQ(beyond.normal.norm(), 0.0);
}

TEST(StaticMotionTest, StandingCameraSeesEveryMotion) {
  const Eigen::Vector3d point(1.0, 0.5, 2.0);
  const StaticResidual found = compareWithStatic(
      follow(point, Eigen::Vector3d(0.1, 0.0, 0.0), RigidTransform()), RigidTransform(), 0.0, 3.0);
  ASSERT_TRUE(found.is_valid);
  const Eigen::Vector3d before = point - Eigen::Vector3d(0.1, 0.0, 0.0);
  EXPECT_NEAR(std::atan(found.residual_rad.norm()), std::acos(point.normalized().dot(before.normalized())),
              1e-9);
}

TEST(StaticMotionTest, PointBehindTheEarlierCameraIsInvalid) {
  const RigidTransform turned(rotationFromVector({0.0, 3.0, 0.0}), Eigen::Vector3d::Zero());
  EXPECT_FALSE(
      compareWithStatic({Eigen::Vector3d::UnitZ(), Eigen::Vector3d::UnitZ()}, turned, 0.0, 3.0).is_valid);
}

}  // namespace
}  // namespace vcharge
