#include "points/panorama.h"

#include <cmath>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include "objects/moving_world.h"

namespace vcharge {
namespace {

class PanoramaTest : public testing::Test {
 protected:
  static constexpr double kHeight_m = 0.7;
  const CameraRig rig_ = makeFrontRig(kHeight_m);
  const RigCamera& camera_ = rig_.cameras[0];
  const Panorama panorama_{camera_};
};

TEST_F(PanoramaTest, ColumnsAreAzimuthsAndRowsAreSlopes) {
  for (const Eigen::Vector3d& from_camera :
       {Eigen::Vector3d(5.0, 0.0, 0.0), Eigen::Vector3d(3.0, 2.0, 0.8), Eigen::Vector3d(2.0, -4.0, -0.7)}) {
    Eigen::Vector2d pixel;
    ASSERT_TRUE(
        camera_.model.project(camera_.vehicle_from_camera->rotation().conjugate() * from_camera, &pixel));
    cv::Mat image = cv::Mat::zeros(camera_.image_size_px, CV_8UC1);
    cv::circle(image, cv::Point(cvRound(pixel.x()), cvRound(pixel.y())), 3, cv::Scalar(255), cv::FILLED);
    const cv::Moments found = cv::moments(panorama_.render(image), true);
    ASSERT_GT(found.m00, 0.0);
    EXPECT_NEAR(found.m10 / found.m00, panorama_.columnOf(std::atan2(from_camera.y(), from_camera.x())), 1.0);
    EXPECT_NEAR(found.m01 / found.m00, panorama_.rowOf(from_camera.z() / from_camera.head<2>().norm()), 1.0);
  }
}

TEST_F(PanoramaTest, WhatTheCameraDoesNotSeeIsInvalidAndBlack) {
  const cv::Mat panorama = panorama_.render(cv::Mat(camera_.image_size_px, CV_8UC1, cv::Scalar(200)));
  ASSERT_EQ(panorama.size(), panorama_.validMask().size());
  EXPECT_EQ(cv::countNonZero((panorama_.validMask() == 0) & (panorama > 200)), 0);
  EXPECT_EQ(cv::countNonZero((panorama_.validMask() != 0) & (panorama == 0)), 0);
  EXPECT_LT(cv::countNonZero(panorama_.validMask()), panorama.rows * panorama.cols);
}

}  // namespace
}  // namespace vcharge
