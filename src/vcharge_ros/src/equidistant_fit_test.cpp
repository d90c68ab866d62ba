#include "vcharge_ros/equidistant_fit.h"

#include <cmath>

#include <sensor_msgs/distortion_models.h>

#include "test_support.h"
#include "vcharge_ros/camera_info.h"

namespace vcharge {
namespace {

constexpr double kFieldOfView_rad = 3.2289;  // 185 degrees

KannalaBrandtCamera someKannalaBrandt() {
  KannalaBrandtCamera::Parameters parameters;
  parameters << 390.0, 393.0, 640.0, 397.0, -0.02, 0.004, -0.001, 0.0001;
  return KannalaBrandtCamera(parameters);
}

TEST(EquidistantFitTest, FindsAnEquidistantCameraAgain) {
  const KannalaBrandtCamera truth = someKannalaBrandt();
  const EquidistantFit fit = fitEquidistant(truth, cv::Size(1280, 800), 3.0);
  EXPECT_LT(fit.max_px, 1e-6);
  EXPECT_LT((fit.camera.parameters() - truth.parameters()).cwiseAbs().maxCoeff(), 1e-6);
}

// r(theta) = f tan(theta / 2) is the unified model with xi = 1 (and gamma = f): stereographic.
TEST(EquidistantFitTest, ResidualIsTheDistanceBetweenTheTwoModels) {
  const double focal = 300.0;
  const cv::Size size(1280, 800);
  const MeiCamera camera(1.0, 2.0 * focal, 2.0 * focal, 639.5, 399.5);
  const EquidistantFit fit = fitEquidistant(camera, size, kFieldOfView_rad);
  double max_px = 0.0;
  for (double theta = 0.0; theta < 0.5 * kFieldOfView_rad; theta += 0.01) {
    for (double phi = 0.0; phi < 6.2; phi += 0.1) {
      const double r = 2.0 * focal * std::tan(0.5 * theta);
      const Eigen::Vector2d truth(639.5 + r * std::cos(phi), 399.5 + r * std::sin(phi));
      if (truth.x() < 0 || truth.x() > size.width - 1 || truth.y() < 0 || truth.y() > size.height - 1) {
        continue;
      }
      Eigen::Vector2d pixel;
      ASSERT_TRUE(fit.camera.project(
          Eigen::Vector3d(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)),
          &pixel));
      max_px = std::max(max_px, (pixel - truth).norm());
    }
  }
  // The maximum is taken over other pixels here and there.
  EXPECT_NEAR(fit.max_px, max_px, 0.2 * max_px + 1e-3);
  EXPECT_LT(fit.rms_px, fit.max_px);
  // Four coefficients follow the tangent's series to the term of theta^9; the next is 2 f (theta / 2)^11 *
  // 1382/155925.
  EXPECT_LT(fit.max_px, 2.0 * focal * std::pow(0.25 * kFieldOfView_rad, 11) * 1382.0 / 155925.0);
}

TEST(EquidistantFitTest, RefusesAFieldOfViewWithoutPixels) {
  EXPECT_THROW(fitEquidistant(someKannalaBrandt(), cv::Size(1280, 800), 0.001), std::invalid_argument);
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
