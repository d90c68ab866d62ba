#include "vcharge_reconstruction/bundle_adjustment.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "vcharge_reconstruction/testing/test_drive.h"

namespace vcharge {
namespace {

/// Adds drift, as of chained motions, to the poses, and noise to the points.
void disturb(ReconstructionData* data) {
  std::mt19937 random(5);
  std::normal_distribution<double> noise(0.0, 1.0);
  for (size_t i = 1; i < data->keyframes.size(); ++i) {
    const double ratio = static_cast<double>(i) / static_cast<double>(data->keyframes.size());
    RigidTransform& pose = data->keyframes[i].map_from_vehicle;
    Eigen::Vector3d shift(0.3 * ratio, -0.2 * ratio, 0.05 * ratio);
    for (int axis = 0; axis < 3; ++axis) {
      shift[axis] += 0.01 * noise(random);
    }
    pose = RigidTransform(rotationFromVector(Eigen::Vector3d(0.004, -0.005, 0.02) * ratio) * pose.rotation(),
                          pose.translation() + shift);
  }
  for (Track& track : data->tracks) {
    for (int axis = 0; axis < 3; ++axis) {
      (*track.position_m)[axis] += 0.1 * noise(random);
    }
  }
}

double worstPositionError(const ReconstructionData& a, const ReconstructionData& b) {
  double worst = 0.0;
  for (size_t i = 0; i < a.keyframes.size(); ++i) {
    worst = std::max(
        worst, (a.keyframes[i].map_from_vehicle.translation() - b.keyframes[i].map_from_vehicle.translation())
                   .norm());
  }
  return worst;
}

TEST(BundleAdjustmentTest, FindsPosesAndTheOdometersScale) {
  testing::TestDriveOptions drive;
  drive.odometry_scale = 1.02;
  const ReconstructionData truth = testing::makeTestDrive(drive);
  ReconstructionData data = truth;
  disturb(&data);
  EXPECT_GT(worstPositionError(data, truth), 0.2);
  BundleAdjustmentOptions options;
  options.max_iterations = 50;
  const BundleAdjustmentSummary summary = adjustBundle(options, &data);
  EXPECT_LT(worstPositionError(data, truth), 1e-3);
  EXPECT_NEAR(data.odometry_distance_scale, 1.0 / 1.02, 5e-4);
  EXPECT_LT(summary.rms_px, 0.01);
  EXPECT_EQ(summary.num_removed_observations, 0);
}

TEST(BundleAdjustmentTest, RemovesWrongObservationsOnly) {
  testing::TestDriveOptions drive;
  drive.noise_px = 0.3;
  const ReconstructionData truth = testing::makeTestDrive(drive);
  ReconstructionData data = truth;
  int64_t num_wrong = 0;
  for (size_t t = 0; t < data.tracks.size(); t += 5) {
    for (size_t i = 0; i < data.tracks[t].observations.size(); i += 7) {
      data.tracks[t].observations[i].position_px += Eigen::Vector2d(20.0, -12.0);
      ++num_wrong;
    }
  }
  disturb(&data);
  BundleAdjustmentOptions options;
  options.max_iterations = 50;
  const BundleAdjustmentSummary summary = adjustBundle(options, &data);
  EXPECT_LT(worstPositionError(data, truth), 0.05) << "a quarter of a percent of the way";
  EXPECT_NEAR(summary.rms_px, drive.noise_px, 0.03);
  EXPECT_GE(summary.num_removed_observations, num_wrong * 95 / 100);
  EXPECT_LE(summary.num_removed_observations, num_wrong + summary.num_observations / 200);
}

// In the dark, observations err more than their deviations say. An odometer that was good where the images
// were good is good there, too.
TEST(BundleAdjustmentTest, FollowsAGoodOdometerWhereImagesAreBad) {
  testing::TestDriveOptions drive;
  drive.noise_px = 0.3;
  const ReconstructionData truth = testing::makeTestDrive(drive);
  ReconstructionData data = truth;
  const auto num_keyframes = static_cast<int32_t>(data.keyframes.size());
  std::mt19937 random(3);
  std::normal_distribution<double> noise_px(0.0, 5.0);
  for (Track& track : data.tracks) {
    for (TrackObservation& observation : track.observations) {
      if (observation.keyframe > num_keyframes / 3 && observation.keyframe < num_keyframes / 2) {
        observation.position_px += Eigen::Vector2d(noise_px(random), noise_px(random));
      }
    }
  }
  const BundleAdjustmentOptions options;
  ReconstructionData with_estimate = data;
  adjustBundle(options, &with_estimate);
  const OdometryNoise noise = estimateOdometryNoise(options, with_estimate);
  ASSERT_TRUE(noise.back().has_value());
  EXPECT_LT((*noise.back())[0], 0.5 * options.odometry_sigma_m);
  adjustBundle(options, &with_estimate, noise);
  ReconstructionData without = data;
  adjustBundle(options, &without);
  adjustBundle(options, &without);
  EXPECT_LT(worstPositionError(with_estimate, truth), 0.7 * worstPositionError(without, truth));
}

TEST(BundleAdjustmentTest, GivesTheSameTwice) {
  ReconstructionData first = testing::makeTestDrive(testing::TestDriveOptions());
  disturb(&first);
  ReconstructionData second = first;
  adjustBundle(BundleAdjustmentOptions(), &first);
  adjustBundle(BundleAdjustmentOptions(), &second);
  EXPECT_EQ(worstPositionError(first, second), 0.0);
}

}  // namespace
}  // namespace vcharge
