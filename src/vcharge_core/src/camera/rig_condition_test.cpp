#include "vcharge_core/camera/rig_condition.h"

#include <cmath>

#include <gtest/gtest.h>

namespace vcharge {
namespace {

CameraRig rigOfTwo() {
  return parseCameraRig(R"(
cameras:
  front: &camera
    image_size_px: [640, 480]
    model: kannala_brandt
    intrinsics: {fx: 200, fy: 201, cx: 320, cy: 240, k1: 0.01, k2: 0, k3: 0, k4: 0}
    vehicle_from_camera: {translation_m: [1, 2, 3], rotation_xyzw: [0, 0, 0, 1]}
  rear: *camera
)",
                        "rig.yaml", ".");
}

TEST(RigCondition, HasTheDeviationsOfTheCovariance) {
  CameraRig rig = rigOfTwo();
  Eigen::Matrix<double, 6, 1> variances;
  variances << 1e-6, 4e-6, 4e-6, 1e-8, 1e-8, 4e-8;
  rig.cameras[1].covariance = Eigen::Matrix<double, 6, 6>(variances.asDiagonal());
  const RigCondition condition = conditionAsCalibrated(rig);
  ASSERT_EQ(condition.size(), 2U);
  EXPECT_EQ(condition[0], CameraCondition());
  EXPECT_FALSE(condition[1].has_moved);
  EXPECT_NEAR(condition[1].position_sigma_m, std::sqrt(3e-6), 1e-12);
  EXPECT_NEAR(condition[1].rotation_sigma_rad, std::sqrt(2e-8), 1e-12);
}

}  // namespace
}  // namespace vcharge
