#include "vcharge_evaluation/trajectory_errors.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "vcharge_core/base/error.h"

namespace vcharge {
namespace {

/// A circle of 10 m radius at 2 m/s, 12.5 Hz.
Trajectory circle(int num_poses) {
  Trajectory trajectory;
  for (int i = 0; i < num_poses; ++i) {
    const double angle = 0.016 * i;
    trajectory.push_back(
        {Timestamp::fromNanoseconds(1000000000000 + 80000000LL * i),
         RigidTransform::planar(10.0 * std::sin(angle), 10.0 * (1.0 - std::cos(angle)), angle)});
  }
  return trajectory;
}

Trajectory moved(const RigidTransform& new_from_old, Trajectory trajectory) {
  for (StampedTransform& entry : trajectory) {
    entry.world_from_vehicle = new_from_old * entry.world_from_vehicle;
  }
  return trajectory;
}

TEST(TrajectoryErrorsTest, ConstantOffsetIsAnErrorUnlessAligned) {
  const Trajectory truth = circle(200);
  const RigidTransform offset(rotationFromVector(Eigen::Vector3d(0.0, 0.0, 0.1)),
                              Eigen::Vector3d(3.0, 4.0, 0.0));
  const Trajectory estimate = moved(offset, truth);
  EXPECT_GT(evaluateTrajectory(estimate, truth, TrajectoryAlignment::kNone).position_m.percentile_50, 3.0);
  EXPECT_NEAR(evaluateTrajectory(estimate, truth, TrajectoryAlignment::kNone).rotation_rad.max, 0.1, 1e-9);
  EXPECT_LE(evaluateTrajectory(estimate, truth, TrajectoryAlignment::kFirstPose).position_m.max, 1e-9);
  EXPECT_LE(evaluateTrajectory(estimate, truth, TrajectoryAlignment::kSe3).position_m.max, 1e-9);
}

TEST(TrajectoryErrorsTest, ErrorsAreInTheAxesOfTheVehicle) {
  const Trajectory truth = circle(50);
  Trajectory estimate = truth;
  for (StampedTransform& entry : estimate) {
    entry.world_from_vehicle = entry.world_from_vehicle * RigidTransform::planar(0.3, -0.1, 0.0);
  }
  const TrajectoryErrors errors = evaluateTrajectory(estimate, truth, TrajectoryAlignment::kNone);
  EXPECT_NEAR(errors.longitudinal_m.percentile_50, 0.3, 1e-9);
  EXPECT_NEAR(errors.lateral_m.percentile_50, 0.1, 1e-9);
  EXPECT_NEAR(errors.poses[20].translation_in_vehicle_m.y(), -0.1, 1e-9);
}

TEST(TrajectoryErrorsTest, TruthIsInterpolatedAndNeverExtrapolated) {
  const Trajectory truth = circle(100);
  Trajectory estimate;
  for (const double seconds : {-1.0, 0.04, 2.0, 7.0, 9.0}) {
    estimate.push_back({truth.front().stamp + durationFromSeconds(seconds), RigidTransform()});
  }
  const TrajectoryErrors errors = evaluateTrajectory(estimate, truth, TrajectoryAlignment::kNone);
  EXPECT_EQ(errors.poses.size(), 3U);
  EXPECT_EQ(errors.num_without_truth, 2U);
  EXPECT_THROW(evaluateTrajectory({estimate[0]}, truth, TrajectoryAlignment::kNone), InputError);
}

TEST(TrajectoryErrorsTest, DriftOfAWrongScaleIsItsPercentage) {
  const Trajectory truth = circle(400);
  Trajectory estimate = truth;
  for (StampedTransform& entry : estimate) {
    entry.world_from_vehicle =
        RigidTransform(entry.world_from_vehicle.rotation(), 1.02 * entry.world_from_vehicle.translation());
  }
  const DriftErrors drift = evaluateDrift(estimate, truth, 5.0);
  EXPECT_GT(drift.translation_percent.count, 100U);
  // 2 % of the chord, which is a little shorter than the path.
  EXPECT_NEAR(drift.translation_percent.percentile_50, 2.0, 0.03);
  EXPECT_LE(drift.rotation_rad.max, 1e-9);
  EXPECT_EQ(evaluateDrift(estimate, truth, 1e6).translation_percent.count, 0U);
}

TEST(TrajectoryErrorsTest, ScaleErrorDoesNotDependOnThePose) {
  const Trajectory truth = circle(400);
  Trajectory estimate = truth;
  for (StampedTransform& entry : estimate) {
    entry.world_from_vehicle =
        RigidTransform(entry.world_from_vehicle.rotation(), 0.995 * entry.world_from_vehicle.translation());
  }
  estimate = moved(RigidTransform::planar(4.0, -3.0, 2.0), estimate);
  EXPECT_NEAR(*evaluateScaleError(estimate, truth), -0.005, 1e-9);
  Trajectory standing = truth;
  for (StampedTransform& entry : standing) {
    entry.world_from_vehicle = RigidTransform();
  }
  EXPECT_FALSE(evaluateScaleError(estimate, standing).has_value());
  EXPECT_THROW(evaluateScaleError({estimate[0], estimate[1]}, truth), InputError);
}

TEST(AlignPointsTest, RecoversARandomTransform) {
  std::mt19937 generator(4);
  std::normal_distribution<double> normal;
  const auto next = [&] { return normal(generator); };
  for (int trial = 0; trial < 20; ++trial) {
    const RigidTransform target_from_source(Eigen::Quaterniond(next(), next(), next(), next()),
                                            Eigen::Vector3d(next(), next(), next()));
    std::vector<Eigen::Vector3d> source, target;
    const bool planar = trial % 2 == 0;  // planar points also allow a reflection, which is not a rotation
    for (int i = 0; i < 10; ++i) {
      source.emplace_back(next(), next(), planar ? 0.0 : next());
      target.push_back(target_from_source * source.back());
    }
    EXPECT_LE((alignPoints(source, target).matrix() - target_from_source.matrix()).norm(), 1e-9);
  }
  EXPECT_THROW(alignPoints({Eigen::Vector3d::Zero()}, {Eigen::Vector3d::Zero()}), std::logic_error);
}

}  // namespace
}  // namespace vcharge
