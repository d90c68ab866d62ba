#include "vcharge_reconstruction/ego_motion.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include <gtest/gtest.h>

#include "vcharge_reconstruction/testing/test_drive.h"

namespace vcharge {
namespace {

constexpr double kNoise_rad = 0.0005;

/// Random points around the car, high ones too (those near the horizon hardly constrain the direction of
/// motion), seen by both cameras of the test rig before and after a motion.
std::vector<RayMatch> makeMatches(const RigidTransform& previous_from_current, double wrong_fraction) {
  const auto rig = testing::makeTestRig();
  std::mt19937 random(3);
  std::uniform_real_distribution<double> coordinate(-12.0, 12.0), height(-1.0, 9.0), uniform(0.0, 1.0);
  std::normal_distribution<double> noise(0.0, kNoise_rad);
  std::vector<RayMatch> matches;
  while (matches.size() < 300) {
    const int camera = static_cast<int>(matches.size() % 2);
    const RigidTransform& vehicle_from_camera = *rig->cameras[camera].vehicle_from_camera;
    Eigen::Vector3d point;
    point.x() = coordinate(random);
    point.y() = coordinate(random);
    point.z() = height(random);
    const Eigen::Vector3d seen = vehicle_from_camera.inverse() * point;
    if (seen.norm() < 2.0 || seen.z() < 0.0) {
      continue;
    }
    if (uniform(random) < wrong_fraction) {
      point = Eigen::Vector3d(point.y() + 3.0, point.x(), point.z() + 1.0);
    }
    const auto rayTo = [&](const Eigen::Vector3d& point_in_vehicle) {
      Eigen::Vector3d direction = (point_in_vehicle - vehicle_from_camera.translation()).normalized();
      for (int i = 0; i < 3; ++i) {
        direction[i] += noise(random);
      }
      return Ray{vehicle_from_camera.translation(), direction.normalized()};
    };
    RayMatch match;
    match.previous = rayTo(vehicle_from_camera * seen);
    match.current = rayTo(previous_from_current.inverse() * point);
    match.previous_camera = match.current_camera = camera;
    matches.push_back(match);
  }
  return matches;
}

RigidTransform circle(double distance_m, double turn_rad) {
  return RigidTransform::planar(distance_m * std::cos(0.5 * turn_rad), distance_m * std::sin(0.5 * turn_rad),
                                turn_rad);
}

double turnBetween(const RigidTransform& a, const RigidTransform& b) {
  return angleOfRotation(a.rotation().conjugate() * b.rotation());
}

TEST(EgoMotionTest, FollowsACircleWithOutliersAndACoarseOdometer) {
  const RigidTransform truth = circle(0.3, 0.04);
  const EgoMotion motion =
      estimateEgoMotion(makeMatches(truth, 0.2), circle(0.306, 0.035), EgoMotionOptions());
  EXPECT_EQ(motion.hypothesis, MotionHypothesis::kAckermann);
  EXPECT_LT((motion.previous_from_current.translation() - truth.translation()).norm(), 0.008);
  EXPECT_LT(turnBetween(motion.previous_from_current, truth), 0.0007) << "better than the odometer";
}

TEST(EgoMotionTest, TakesTheLengthOfStraightMotionFromTheOdometer) {
  const EgoMotion motion =
      estimateEgoMotion(makeMatches(circle(0.3, 0.0), 0.0), circle(0.31, 0.0), EgoMotionOptions());
  EXPECT_EQ(motion.hypothesis, MotionHypothesis::kAckermann);
  EXPECT_NEAR(motion.previous_from_current.translation().x(), 0.31, 0.005);
}

TEST(EgoMotionTest, DetectsSidewaysSlip) {
  const RigidTransform truth = RigidTransform::planar(0.25, 0.15, 0.02);
  const EgoMotion motion = estimateEgoMotion(makeMatches(truth, 0.1), circle(0.25, 0.02), EgoMotionOptions());
  EXPECT_EQ(motion.hypothesis, MotionHypothesis::kPlanar);
  const Eigen::Vector3d direction = motion.previous_from_current.translation().normalized();
  EXPECT_LT(std::acos(direction.dot(truth.translation().normalized())), 0.05);
}

TEST(EgoMotionTest, DetectsARamp) {
  const RigidTransform truth(rotationFromYawPitchRoll(0.01, 0.03, 0.0), Eigen::Vector3d(0.3, 0.0, 0.02));
  const EgoMotion motion = estimateEgoMotion(makeMatches(truth, 0.1), circle(0.3, 0.01), EgoMotionOptions());
  EXPECT_EQ(motion.hypothesis, MotionHypothesis::kSpatial);
  EXPECT_LT(turnBetween(motion.previous_from_current, truth), 0.002);
}

TEST(EgoMotionTest, FallsBackToTheOdometerWithoutUsableMatches) {
  const RigidTransform odometry = circle(0.3, 0.04);
  std::vector<RayMatch> matches = makeMatches(odometry, 0.0);
  matches.resize(10);
  EXPECT_EQ(estimateEgoMotion(matches, odometry, EgoMotionOptions()).hypothesis, MotionHypothesis::kOdometry);
  EXPECT_EQ(estimateEgoMotion({}, odometry, EgoMotionOptions()).hypothesis, MotionHypothesis::kOdometry);
  matches = makeMatches(odometry, 0.0);
  matches[7].current.direction.x() = std::numeric_limits<double>::quiet_NaN();
  const EgoMotion motion = estimateEgoMotion(matches, odometry, EgoMotionOptions());
  EXPECT_EQ(motion.hypothesis, MotionHypothesis::kOdometry);
  EXPECT_LT(turnBetween(motion.previous_from_current, odometry), 1e-12);
}

TEST(EgoMotionTest, MarksInliers) {
  const RigidTransform truth = circle(0.3, 0.04);
  const EgoMotion clean = estimateEgoMotion(makeMatches(truth, 0.0), truth, EgoMotionOptions());
  const EgoMotion mixed = estimateEgoMotion(makeMatches(truth, 0.4), truth, EgoMotionOptions());
  const auto numTrue = [](const std::vector<bool>& flags) {
    return std::count(flags.begin(), flags.end(), true);
  };
  EXPECT_GT(numTrue(clean.is_inlier), 285);
  EXPECT_LT(numTrue(mixed.is_inlier), 240);
  EXPECT_GT(numTrue(mixed.is_inlier), 150);
}

}  // namespace
}  // namespace vcharge
