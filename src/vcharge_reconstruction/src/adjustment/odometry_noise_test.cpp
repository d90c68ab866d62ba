#include "vcharge_reconstruction/adjustment/odometry_noise.h"

#include <algorithm>
#include <random>

#include <gtest/gtest.h>

#include "vcharge_core/motion/pose_step.h"

namespace vcharge {
namespace {

OdometrySigmas sigmasOf(double forwards_m, double sideways_m, double turn_rad) {
  OdometrySigmas sigmas;
  sigmas << forwards_m, sideways_m, 0.002, 0.001, 0.001, turn_rad;
  return sigmas;
}

const OdometrySigmas kSigmas = sigmasOf(0.003, 0.001, 0.0005);
const OdometrySigmas kMost = 10.0 * kSigmas;

/// Adds a session that drives a curve. Its odometer counts the planar part of the motions; the deviations
/// are of its errors, and of the motions from the plane.
void addSession(const OdometrySigmas& sigmas, int num_motions, ReconstructionData* data) {
  std::mt19937 random(static_cast<uint32_t>(data->keyframes.size()));
  std::normal_distribution<double> normal;
  const int32_t session = data->keyframes.empty() ? 0 : data->keyframes.back().session + 1;
  for (int i = 0; i <= num_motions; ++i) {
    Keyframe keyframe;
    keyframe.session = session;
    if (i > 0) {
      const RigidTransform motion = RigidTransform::planar(0.5, 0.01, 0.04);
      OdometrySigmas counted, from_plane;
      for (Eigen::Index axis = 0; axis < sigmas.size(); ++axis) {
        const bool is_counted = axis < 2 || axis == 5;
        counted[axis] = is_counted ? sigmas[axis] * normal(random) : 0.0;
        from_plane[axis] = is_counted ? 0.0 : sigmas[axis] * normal(random);
      }
      keyframe.map_from_vehicle = data->keyframes.back().map_from_vehicle * moved(motion, from_plane);
      keyframe.odom_from_vehicle = data->keyframes.back().odom_from_vehicle * moved(motion, counted);
    }
    data->keyframes.push_back(keyframe);
  }
}

/// Lets the odometer count a distance that the vehicle does not drive, before a keyframe.
void slip(size_t keyframe, double distance_m, ReconstructionData* data) {
  const RigidTransform before = data->keyframes[keyframe - 1].odom_from_vehicle;
  const RigidTransform slipped = before * RigidTransform::planar(distance_m, 0.0, 0.0) * before.inverse();
  for (size_t i = keyframe; i < data->keyframes.size(); ++i) {
    data->keyframes[i].odom_from_vehicle = slipped * data->keyframes[i].odom_from_vehicle;
  }
}

TEST(OdometryNoiseTest, IsThatOfTheDriveInEachAxis) {
  ReconstructionData data;
  addSession(kSigmas, 400, &data);
  const OdometryNoise noise = estimateOdometryNoise(data, kMost);
  ASSERT_EQ(noise.size(), data.keyframes.size());
  EXPECT_FALSE(noise[0].has_value()) << "no motion leads to the first keyframe";
  for (Eigen::Index axis = 0; axis < kSigmas.size(); ++axis) {
    EXPECT_NEAR((*noise[200])[axis] / kSigmas[axis], 1.0, 0.15) << "axis " << axis;
  }
  for (size_t i = 1; i < noise.size(); ++i) {
    ASSERT_EQ(*noise[i], *noise[200]) << "no motion has slipped";
  }
}

TEST(OdometryNoiseTest, IsNeverMoreThanAssumedNorNothing) {
  ReconstructionData data;
  addSession(3.0 * kMost, 100, &data);
  EXPECT_EQ(*estimateOdometryNoise(data, kMost)[50], kMost);
  ReconstructionData exact;
  addSession(OdometrySigmas::Zero(), 100, &exact);
  EXPECT_GE(estimateOdometryNoise(exact, kMost)[50]->minCoeff(), 1e-4);
}

TEST(OdometryNoiseTest, GivesMotionsThatSlippedLittleWeight) {
  ReconstructionData data;
  addSession(kSigmas, 100, &data);
  slip(60, 0.1, &data);
  const OdometryNoise noise = estimateOdometryNoise(data, kMost);
  EXPECT_GT((*noise[60])[0], 10.0 * kSigmas[0]);
  const auto is_usual = [&](const auto& sigmas) { return sigmas && (*sigmas)[0] < 2.0 * kSigmas[0]; };
  EXPECT_EQ(std::count_if(noise.begin(), noise.end(), is_usual), 99);
}

// Where all motions are seen badly, it is the images that err. The odometer must hold the map together there.
TEST(OdometryNoiseTest, DoesNotTakeBadlySeenMotionsForSlip) {
  ReconstructionData data;
  addSession(kSigmas, 200, &data);
  std::mt19937 random(1);
  std::normal_distribution<double> normal(0.0, 0.03);
  for (size_t i = 80; i < 120; ++i) {
    RigidTransform& seen = data.keyframes[i].map_from_vehicle;
    seen = seen * RigidTransform::planar(normal(random), normal(random), 0.0);
  }
  const OdometryNoise noise = estimateOdometryNoise(data, kMost);
  const auto has_slipped = [&](const auto& sigmas) { return sigmas && (*sigmas)[0] > 2.0 * kSigmas[0]; };
  EXPECT_LE(std::count_if(noise.begin() + 80, noise.begin() + 120, has_slipped), 2);
}

TEST(OdometryNoiseTest, IsEstimatedForEachSession) {
  ReconstructionData data;
  addSession(kSigmas, 200, &data);
  addSession(kSigmas, 5, &data);
  addSession(3.0 * kSigmas, 200, &data);
  data.keyframes[207].odom_from_vehicle = RigidTransform::planar(99.0, 0.0, 0.0);  // of no importance
  const OdometryNoise noise = estimateOdometryNoise(data, kMost);
  EXPECT_NEAR((*noise[100])[0] / kSigmas[0], 1.0, 0.2);
  EXPECT_FALSE(noise[201].has_value()) << "a border between sessions";
  EXPECT_FALSE(noise[205].has_value()) << "too short";
  EXPECT_NEAR((*noise[300])[0] / kSigmas[0], 3.0, 0.6);
}

}  // namespace
}  // namespace vcharge
