// A camera that looks down to the left, on a straight drive beside a wall.
#include "initialization/ground_normal.h"
#include "vcharge_reconstruction/testing/test_camera.h"

#include <cmath>
#include <memory>
#include <random>

#include <gtest/gtest.h>

namespace vcharge {
namespace {

using testing::makeExtrinsics;

constexpr double kDegree = 0.017453292519943295;
constexpr int kNumKeyframes = 10;
constexpr double kStep_m = 0.5;

struct StraightDrive {
  ReconstructionData data;
  std::vector<MotionPair> motions;
  Eigen::Vector3d up_in_camera;
};

struct SceneOptions {
  double noise_px = 0.2;
  int num_ground = 300;
  int num_wall = 600;
};

StraightDrive makeStraightDrive(const SceneOptions& scene) {
  KannalaBrandtCamera::Parameters parameters;
  parameters << 400.0, 400.0, 639.5, 399.5, 0.0, 0.0, 0.0, 0.0;
  RigCamera camera{"left", "camera_left_optical", cv::Size(1280, 800), KannalaBrandtCamera(parameters)};
  const RigidTransform vehicle_from_camera = makeExtrinsics(1.57, 0.7, 0.05, {1.9, 0.95, 0.9});
  StraightDrive drive;
  auto rig = std::make_shared<CameraRig>();
  rig->cameras = {camera};
  drive.data.rig = rig;
  drive.up_in_camera = vehicle_from_camera.rotation().conjugate() * Eigen::Vector3d::UnitZ();
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0.0, scene.noise_px);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  for (int k = 0; k < kNumKeyframes; ++k) {
    Keyframe keyframe;
    keyframe.odom_from_vehicle = RigidTransform::planar(kStep_m * k, 0.0, 0.0);
    drive.data.keyframes.push_back(keyframe);
    if (k > 0) {
      MotionPair motion;
      motion.keyframe = k - 1;
      motion.vehicle = RigidTransform::planar(kStep_m, 0.0, 0.0);
      motion.camera_rotation = Eigen::Quaterniond::Identity();
      motion.camera_direction = vehicle_from_camera.rotation().conjugate() * Eigen::Vector3d::UnitX();
      drive.motions.push_back(motion);
    }
  }
  for (int p = 0; p < scene.num_ground + scene.num_wall; ++p) {
    const double x = 10.0 * uniform(random) - 1.0;
    const Eigen::Vector3d point = p < scene.num_ground ? Eigen::Vector3d(x, 1.2 + 4.0 * uniform(random), 0.0)
                                                       : Eigen::Vector3d(x, 4.0, 0.2 + 2.0 * uniform(random));
    Track track;
    for (int k = 0; k < kNumKeyframes; ++k) {
      const Eigen::Vector3d in_camera =
          (drive.data.keyframes[k].odom_from_vehicle * vehicle_from_camera).inverse() * point;
      Eigen::Vector2d pixel;
      if (in_camera.z() > 0.2 * in_camera.norm() && camera.model.project(in_camera, &pixel)) {
        const double du = noise(random);
        const double dv = noise(random);
        track.observations.push_back({k, 0, -1, pixel + Eigen::Vector2d(du, dv), 0.3});
      }
    }
    if (track.observations.size() >= 3) {
      drive.data.tracks.push_back(track);
    }
  }
  return drive;
}

TEST(GroundNormalTest, IsFoundBesideAWallWithMorePoints) {
  const StraightDrive drive = makeStraightDrive(SceneOptions());
  const std::optional<Eigen::Vector3d> up = findUpwards(drive.data, 0, drive.motions, TriangulationOptions());
  ASSERT_TRUE(up.has_value());
  EXPECT_NEAR(up->norm(), 1.0, 1e-9);
  EXPECT_LT(std::acos(std::min(1.0, up->dot(drive.up_in_camera))), 0.2 * kDegree)
      << up->transpose() << ", expected " << drive.up_in_camera.transpose();
}

TEST(GroundNormalTest, IsEmptyWithoutGround) {
  SceneOptions scene;
  scene.num_ground = 0;
  const StraightDrive wall = makeStraightDrive(scene);
  EXPECT_FALSE(findUpwards(wall.data, 0, wall.motions, TriangulationOptions()).has_value());
  scene.num_wall = 0;
  const StraightDrive nothing = makeStraightDrive(scene);
  EXPECT_FALSE(findUpwards(nothing.data, 0, nothing.motions, TriangulationOptions()).has_value());
}

}  // namespace
}  // namespace vcharge
