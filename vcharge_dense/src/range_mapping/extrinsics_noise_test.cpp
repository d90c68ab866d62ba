#include "range_mapping/extrinsics_noise.h"

#include <random>

#include <gtest/gtest.h>

#include "vcharge_core/motion/pose_step.h"

namespace vcharge {
namespace {

/// Mean squares per axis of the errors of a camera's motion, over random errors of its extrinsics.
struct MeanSquares {
  double rotation_rad2 = 0.0, translation_m2 = 0.0;
};

MeanSquares sample(const RigidTransform& vehicle_motion, const CameraCondition& camera) {
  const RigidTransform vehicle_from_camera(rotationFromVector({-1.2, 0.9, 0.3}), {0.8, 0.9, 1.0});
  const RigidTransform true_motion = vehicle_from_camera.inverse() * vehicle_motion * vehicle_from_camera;
  std::mt19937 generator(5);
  std::normal_distribution<double> normal;
  constexpr int kSamples = 4000;
  MeanSquares result;
  for (int i = 0; i < kSamples; ++i) {
    Eigen::Matrix<double, 6, 1> step;
    for (int axis = 0; axis < 3; ++axis) {
      step[axis] = camera.position_sigma_m * normal(generator);
      step[axis + 3] = camera.rotation_sigma_rad * normal(generator);
    }
    const RigidTransform wrong = moved(vehicle_from_camera, step);
    const auto error = stepBetween(true_motion, wrong.inverse() * vehicle_motion * wrong);
    result.translation_m2 += error.head<3>().squaredNorm() / (3.0 * kSamples);
    result.rotation_rad2 += error.tail<3>().squaredNorm() / (3.0 * kSamples);
  }
  return result;
}

// Two of three axes are affected: along the translation and along the axis of the turn nothing changes.
TEST(ExtrinsicsNoise, IsThatOfTheMotionsOfWrongCameras) {
  const CameraCondition camera{true, 0.02, 0.01};
  const RigidTransform straight(Eigen::Quaterniond::Identity(), {0.6, 0.0, 0.0});
  const RigidTransform turn(rotationFromVector({0.0, 0.0, 0.3}), {0.0, 0.0, 0.0});
  for (const RigidTransform& motion : {straight, turn, straight * turn}) {
    NeighbourNoise noise;
    const RigidTransform vehicle_from_camera(rotationFromVector({-1.2, 0.9, 0.3}), {0.8, 0.9, 1.0});
    addNoiseOfExtrinsics(camera, vehicle_from_camera.inverse() * motion * vehicle_from_camera, &noise);
    const MeanSquares sampled = sample(motion, camera);
    EXPECT_NEAR(sampled.translation_m2, 2.0 / 3.0 * noise.more_translation_m2,
                0.2 * noise.more_translation_m2);
    EXPECT_NEAR(sampled.rotation_rad2, 2.0 / 3.0 * noise.more_rotation_rad2,
                0.2 * noise.more_rotation_rad2 + 1e-15);
  }
}

TEST(ExtrinsicsNoise, IsAddedToOtherNoise) {
  NeighbourNoise noise;
  noise.more_translation_m2 = 1.0;
  addNoiseOfExtrinsics({}, RigidTransform(Eigen::Quaterniond::Identity(), {1.0, 0.0, 0.0}), &noise);
  EXPECT_EQ(noise.more_translation_m2, 1.0);
  EXPECT_EQ(noise.more_rotation_rad2, 0.0);
  EXPECT_EQ(noise.rotation_left, 1.0);
}

}  // namespace
}  // namespace vcharge
