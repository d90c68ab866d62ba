#include "vcharge_evaluation/rig_errors.h"

#include <cmath>

#include <gtest/gtest.h>

#include "vcharge_core/base/error.h"

namespace vcharge {
namespace {

CameraRig makeRig() {
  CameraRig rig;
  for (const auto& [name, x_m, yaw_rad] :
       {std::make_tuple("front", 3.6, 0.0), std::make_tuple("rear", -0.9, 3.0)}) {
    KannalaBrandtCamera::Parameters parameters;
    parameters << 200.0, 200.0, 319.5, 199.5, 0.0, 0.0, 0.0, 0.0;
    RigCamera camera{name, name, cv::Size(640, 400), KannalaBrandtCamera(parameters)};
    camera.vehicle_from_camera = RigidTransform::planar(x_m, 0.1, yaw_rad);
    camera.covariance = 1e-4 * Eigen::Matrix<double, 6, 6>::Identity();
    rig.cameras.push_back(camera);
  }
  return rig;
}

TEST(RigErrorsTest, ScaleAndRemainingErrorsAreFound) {
  const CameraRig truth = makeRig();
  CameraRig estimate = truth;
  for (RigCamera& camera : estimate.cameras) {
    camera.vehicle_from_camera = RigidTransform(camera.vehicle_from_camera->rotation(),
                                                1.01 * camera.vehicle_from_camera->translation());
  }
  estimate.cameras[1].vehicle_from_camera = RigidTransform(
      rotationFromVector({0.0, 0.0, 0.002}) * estimate.cameras[1].vehicle_from_camera->rotation(),
      estimate.cameras[1].vehicle_from_camera->translation());
  const RigErrors errors = evaluateRig(estimate, truth);
  EXPECT_NEAR(errors.scale, 1.0 / 1.01, 1e-9);
  EXPECT_NEAR(errors.as_is[0].error[0], -0.036, 1e-9);
  EXPECT_NEAR((*errors.as_is[0].normalized)[0], -3.6, 1e-6);
  EXPECT_LT(errors.without_scale[0].error.norm(), 1e-9);
  EXPECT_NEAR(errors.without_scale[1].error[5], -0.002, 1e-9);

  estimate.scale_sigma = 0.01;
  const RigErrors uncertain = evaluateRig(estimate, truth);
  EXPECT_NEAR((*uncertain.as_is[0].normalized)[0], -0.036 / std::hypot(0.01, 0.01 * 1.01 * 3.6), 1e-6);
  EXPECT_NEAR((*uncertain.without_scale[1].normalized)[5], (*errors.without_scale[1].normalized)[5], 1e-12);
}

TEST(RigErrorsTest, MissingCameraIsNamed) {
  CameraRig estimate = makeRig();
  estimate.cameras.pop_back();
  try {
    evaluateRig(estimate, makeRig());
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("rear"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace vcharge
