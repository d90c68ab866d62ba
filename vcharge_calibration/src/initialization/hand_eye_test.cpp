#include "vcharge_calibration/initialization/hand_eye.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace vcharge {
namespace {

constexpr double kDegree = 0.017453292519943295;

struct Drive {
  double turn_rad = 0.08;  ///< maximum per motion: to the left in the first half, to the right in the second
  double noise_rad = 0.0;
  double wrong_fraction = 0.0;
  int num_motions = 200;
  uint32_t seed = 1;
};

RigidTransform trueExtrinsics() {
  return RigidTransform(rotationFromYawPitchRoll(1.4, 0.3, -1.9), Eigen::Vector3d(1.9, 0.95, 0.0));
}

/// Motions of a car that turns, and of a camera with the extrinsics trueExtrinsics(), 0.5 m above the ground.
std::vector<MotionPair> makeMotions(const Drive& drive) {
  std::mt19937 random(drive.seed);
  std::normal_distribution<double> noise(0.0, drive.noise_rad);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  const auto draw = [&](auto* distribution) {
    Eigen::Vector3d vector;
    for (double& axis : vector) {
      axis = (*distribution)(random);
    }
    return vector;
  };
  const RigidTransform vehicle_from_camera(trueExtrinsics().rotation(),
                                           trueExtrinsics().translation() + Eigen::Vector3d(0.0, 0.0, 0.5));
  std::vector<MotionPair> motions;
  for (int i = 0; i < drive.num_motions; ++i) {
    // The radius varies: circles of one radius do not determine the position.
    const double turn_rad = drive.turn_rad * std::sin(6.283185 * i / drive.num_motions);
    MotionPair motion;
    motion.vehicle =
        RigidTransform::planar(0.5 * std::cos(0.5 * turn_rad), 0.5 * std::sin(0.5 * turn_rad), turn_rad);
    RigidTransform camera = vehicle_from_camera.inverse() * motion.vehicle * vehicle_from_camera;
    if (uniform(random) < 2.0 * drive.wrong_fraction - 1.0) {
      camera = RigidTransform(rotationFromVector(0.1 * draw(&uniform)), draw(&uniform));
    }
    motion.camera_rotation = camera.rotation();
    motion.camera_direction = camera.translation().normalized();
    if (drive.noise_rad > 0.0) {
      motion.camera_rotation = rotationFromVector(0.1 * draw(&noise)) * motion.camera_rotation;
      motion.camera_direction = rotationFromVector(draw(&noise)) * motion.camera_direction;
    }
    motion.direction_sigma_rad = std::max(1e-4, drive.noise_rad);
    motion.rotation_sigma_rad = std::max(1e-5, 0.1 * drive.noise_rad);
    motions.push_back(motion);
  }
  return motions;
}

double angleBetween(const RigidTransform& a, const RigidTransform& b) {
  return angleOfRotation(a.rotation().conjugate() * b.rotation());
}

TEST(PlanarHandEyeTest, FindsTheTruthWithoutNoise) {
  const HandEye found = solvePlanarHandEye(makeMotions(Drive()), HandEyeOptions());
  ASSERT_EQ(found.status, HandEyeStatus::kOk);
  EXPECT_LT(angleBetween(found.vehicle_from_camera, trueExtrinsics()), 1e-6);
  EXPECT_LT((found.vehicle_from_camera.translation() - trueExtrinsics().translation()).norm(), 1e-6);
  EXPECT_EQ(found.num_inliers, found.num_motions);
}

TEST(PlanarHandEyeTest, HandlesNoiseAndOutliers) {
  Drive drive;
  drive.noise_rad = 0.01;
  drive.wrong_fraction = 0.2;
  const HandEye found = solvePlanarHandEye(makeMotions(drive), HandEyeOptions());
  ASSERT_EQ(found.status, HandEyeStatus::kOk);
  // 160 motions with 0.57 degrees of noise: four standard deviations of the mean, plus the bias by outliers.
  EXPECT_LT(angleBetween(found.vehicle_from_camera, trueExtrinsics()), 0.4 * kDegree);
  // One motion gives the position to 0.01 x 0.5 m / 0.06 = 8 cm at best. Limit: 6 x 8 cm / sqrt(160).
  EXPECT_LT((found.vehicle_from_camera.translation() - trueExtrinsics().translation()).norm(), 0.04);
  EXPECT_LT(found.num_inliers, found.num_motions);
}

TEST(PlanarHandEyeTest, DetectsALackOfTurns) {
  Drive drive;
  drive.turn_rad = 0.0;
  drive.noise_rad = 0.002;
  const HandEye found = solvePlanarHandEye(makeMotions(drive), HandEyeOptions());
  EXPECT_EQ(found.status, HandEyeStatus::kNoTurn);
  // The direction of travel is known without turns.
  const Eigen::Vector3d ahead = trueExtrinsics().rotation().conjugate() * Eigen::Vector3d::UnitX();
  EXPECT_LT(std::acos(found.travel_in_camera.dot(ahead)), 0.002);
}

TEST(PlanarHandEyeTest, DetectsTooFewMotions) {
  Drive drive;
  drive.num_motions = 5;
  EXPECT_EQ(solvePlanarHandEye(makeMotions(drive), HandEyeOptions()).status, HandEyeStatus::kTooFewMotions);
}

TEST(PlanarHandEyeTest, RefusesMotionsThatContradictTheOdometer) {
  Drive drive;
  drive.wrong_fraction = 1.0;
  const HandEye found = solvePlanarHandEye(makeMotions(drive), HandEyeOptions());
  EXPECT_NE(found.status, HandEyeStatus::kOk);
}

TEST(PlanarHandEyeTest, FacesBackwardsWithAReversedOdometer) {
  std::vector<MotionPair> motions = makeMotions(Drive());
  for (MotionPair& motion : motions) {
    motion.vehicle = RigidTransform(motion.vehicle.rotation(), -motion.vehicle.translation());
  }
  const HandEye found = solvePlanarHandEye(motions, HandEyeOptions());
  ASSERT_EQ(found.status, HandEyeStatus::kOk);
  EXPECT_NEAR(angleBetween(found.vehicle_from_camera, trueExtrinsics()), 3.14159265, 1e-6);
}

}  // namespace
}  // namespace vcharge
