#include "vcharge_calibration/report/rig_comparison.h"

#include <gtest/gtest.h>

#include "vcharge_core/base/error.h"

namespace vcharge {
namespace {

CameraRig makeRig(double forwards_m, double yaw_rad) {
  RigCamera camera{
      "front", "camera_front_optical", cv::Size(640, 400),
      KannalaBrandtCamera(
          (KannalaBrandtCamera::Parameters() << 200.0, 200.0, 319.5, 199.5, 0.0, 0.0, 0.0, 0.0).finished())};
  camera.vehicle_from_camera = RigidTransform::planar(forwards_m, 0.0, yaw_rad);
  camera.covariance = 1e-6 * Eigen::Matrix<double, 6, 6>::Identity();
  CameraRig rig;
  rig.cameras.push_back(camera);
  return rig;
}

TEST(RigComparisonTest, DistinguishesMovedCamerasFromNoise) {
  const CameraRig rig = makeRig(3.6, 0.1);
  const RigComparison noise = compareRigs(rig, makeRig(3.602, 0.101));
  ASSERT_EQ(noise.cameras.size(), 1U);
  EXPECT_FALSE(noise.cameras[0].is_significant);
  EXPECT_NEAR(noise.cameras[0].difference[0], 0.002, 1e-9);
  EXPECT_NEAR(noise.cameras[0].difference[5], 0.001, 1e-9);
  // Both rigs' variances add up: 0.002^2 / 2e-6 + 0.001^2 / 2e-6.
  EXPECT_NEAR(noise.cameras[0].chi_square, 2.5, 1e-6);
  EXPECT_TRUE(compareRigs(rig, makeRig(3.61, 0.1)).cameras[0].is_significant);
  EXPECT_TRUE(compareRigs(rig, makeRig(3.6, 0.11)).cameras[0].is_significant);
}

TEST(RigComparisonTest, NamesMissingCameras) {
  CameraRig other = makeRig(3.6, 0.1);
  other.cameras[0].name = "rear";
  const RigComparison comparison = compareRigs(makeRig(3.6, 0.1), other);
  EXPECT_TRUE(comparison.cameras.empty());
  EXPECT_EQ(comparison.only_first, std::vector<std::string>{"front"});
  EXPECT_EQ(comparison.only_second, std::vector<std::string>{"rear"});
}

TEST(RigComparisonTest, RefusesRigsWithoutExtrinsics) {
  CameraRig bare = makeRig(3.6, 0.1);
  bare.cameras[0].vehicle_from_camera.reset();
  EXPECT_THROW(compareRigs(bare, makeRig(3.6, 0.1)), InputError);
}

}  // namespace
}  // namespace vcharge
