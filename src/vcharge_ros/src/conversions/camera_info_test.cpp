#include "vcharge_ros/camera_info.h"

#include <cmath>

#include <sensor_msgs/distortion_models.h>

#include "vcharge_ros/test_support.h"

namespace vcharge {
namespace {

KannalaBrandtCamera someKannalaBrandt() {
  KannalaBrandtCamera::Parameters parameters;
  parameters << 390.0, 393.0, 640.0, 397.0, -0.02, 0.004, -0.001, 0.0001;
  return KannalaBrandtCamera(parameters);
}

TEST(CameraInfoTest, CarriesTheFitAndItsResidual) {
  const CameraRig rig = testing::makeRig(cv::Size(640, 400));
  CameraInfoResidual residual;
  const sensor_msgs::CameraInfo info = makeCameraInfo(rig.cameras[0], &residual);
  EXPECT_EQ(info.header.frame_id, "camera_front_optical");
  EXPECT_EQ(info.width, 640u);
  EXPECT_EQ(info.height, 400u);
  EXPECT_EQ(info.distortion_model, sensor_msgs::distortion_models::EQUIDISTANT);
  const EquidistantFit fit =
      fitEquidistant(rig.cameras[0].model, cv::Size(640, 400), rig.cameras[0].field_of_view_rad);
  ASSERT_EQ(info.D.size(), 4u);
  EXPECT_EQ(info.D[0], fit.camera.parameters()[4]);
  EXPECT_EQ(info.K[0], fit.camera.parameters()[0]);
  EXPECT_EQ(info.K[5], info.P[6]);
  EXPECT_EQ(residual.max_px, fit.max_px);
  EXPECT_GT(residual.rms_px, 0.0);
}

TEST(CameraInfoTest, IsExactForModelsThatRosKnows) {
  CameraInfoResidual residual;
  sensor_msgs::CameraInfo info =
      makeCameraInfo(someKannalaBrandt(), cv::Size(1280, 800), 3.0, "frame", &residual);
  EXPECT_EQ(residual.max_px, 0.0);
  EXPECT_EQ(info.K[4], 393.0);
  PinholeCamera::Parameters parameters;
  parameters << 500, 510, 320, 240, -0.1, 0.01, 0.001, -0.002;
  info = makeCameraInfo(PinholeCamera(parameters), cv::Size(640, 480), 1.5, "frame", &residual);
  EXPECT_EQ(info.distortion_model, sensor_msgs::distortion_models::PLUMB_BOB);
  EXPECT_EQ(info.D, (std::vector<double>{-0.1, 0.01, 0.001, -0.002, 0.0}));
  EXPECT_EQ(residual.max_px, 0.0);
}

TEST(CameraInfoTest, SaysUncalibratedWhereNothingFits) {
  CameraInfoResidual residual;
  const auto info =
      makeCameraInfo(MeiCamera(1.15, 400, 400, 320, 200), cv::Size(640, 400), 0.001, "frame", &residual);
  EXPECT_EQ(info.K[0], 0.0);
  EXPECT_TRUE(std::isinf(residual.max_px));
}

}  // namespace
}  // namespace vcharge
