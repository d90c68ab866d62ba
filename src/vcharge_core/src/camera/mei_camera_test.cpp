#include "vcharge_core/camera/mei_camera.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>
#include <opencv2/ccalib/omnidir.hpp>

namespace vcharge {
namespace {

MeiCamera golfCamera() {
  return MeiCamera(
      (MeiCamera::Parameters() << 1.158, 895.5, 894.7, 649.6, 398.7, -0.3308, 0.0865, -0.00068, -3.6e-5)
          .finished());
}

TEST(MeiCameraTest, AgreesWithOpenCvOmnidirInBothDirections) {
  const MeiCamera camera = golfCamera();
  const cv::Matx33d k(camera.gamma1(), 0, camera.u0(), 0, camera.gamma2(), camera.v0(), 0, 0, 1);
  const RadialTangentialDistortion& d = camera.distortion();
  const cv::Vec4d distortion(d.k1(), d.k2(), d.p1(), d.p2());
  std::mt19937 generator(3);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  std::vector<cv::Vec3d> points;
  while (points.size() < 1000) {
    const cv::Vec3d point(uniform(generator), uniform(generator), uniform(generator));
    if (cv::norm(point) > 0.1 && point[2] > -0.1 * cv::norm(point)) {
      points.push_back(point);
    }
  }
  std::vector<cv::Vec2d> theirs;
  cv::omnidir::projectPoints(points, theirs, cv::Vec3d(0, 0, 0), cv::Vec3d(0, 0, 0), cv::Mat(k), camera.xi(),
                             cv::Mat(distortion));
  // OpenCV's undistortion runs a fixed number of iterations, which is exact only for weak distortion.
  std::vector<cv::Vec2d> undistorted;
  cv::omnidir::undistortPoints(theirs, undistorted, cv::Mat(k), cv::Mat(distortion),
                               cv::Mat(cv::Vec<double, 1>(camera.xi())), cv::Mat::eye(3, 3, CV_64F));
  int compared = 0;
  for (size_t i = 0; i < points.size(); ++i) {
    Eigen::Vector2d pixel;
    const Eigen::Vector3d point(points[i][0], points[i][1], points[i][2]);
    ASSERT_TRUE(camera.project(point, &pixel));
    EXPECT_NEAR(pixel.x(), theirs[i][0], 1e-9);
    EXPECT_NEAR(pixel.y(), theirs[i][1], 1e-9);
    if (point.z() > 0.5 * point.norm()) {
      Eigen::Vector3d ray;
      ASSERT_TRUE(camera.unproject(pixel, &ray));
      EXPECT_NEAR(ray.x() / ray.z(), undistorted[i][0], 1e-4);
      EXPECT_NEAR(ray.y() / ray.z(), undistorted[i][1], 1e-4);
      ++compared;
    }
  }
  EXPECT_GT(compared, 100);
}

TEST(MeiCameraTest, FollowsThePaperOnAPointByHand) {
  // P = (3, 0, 4): on the sphere (0.6, 0, 0.8); with xi = 1.2: x_u = 0.3, r = 0.09.
  const MeiCamera camera(
      (MeiCamera::Parameters() << 1.2, 100, 200, 10, 20, -0.5, 2.0, 0.01, 0.02).finished());
  Eigen::Vector2d pixel;
  ASSERT_TRUE(camera.project(Eigen::Vector3d(3, 0, 4), &pixel));
  const double x_d = 0.3 + 0.3 * (-0.5 * 0.09 + 2.0 * 0.09 * 0.09) + 0.02 * (0.09 + 2 * 0.09);
  const double y_d = 0.01 * 0.09;
  EXPECT_NEAR(pixel.x(), 100 * x_d + 10, 1e-12);
  EXPECT_NEAR(pixel.y(), 200 * y_d + 20, 1e-12);
}

TEST(MeiCameraTest, SeesBeyondNinetyDegreesUpToItsLimit) {
  const MeiCamera camera(1.25, 400, 400, 640, 400);  // limit: cos(angle) = -1 / 1.25, 143.1 degrees
  const double limit = std::acos(-1.0 / 1.25);
  const auto ray = [](double angle) { return Eigen::Vector3d(std::sin(angle), 0.0, std::cos(angle)); };
  Eigen::Vector2d pixel;
  EXPECT_TRUE(camera.project(ray(limit - 1e-3), &pixel));
  EXPECT_FALSE(camera.project(ray(limit + 1e-3), &pixel));
  // No ray has a pixel beyond r_u^2 = 1 / (xi^2 - 1).
  const double max_radius = 1.0 / std::sqrt(1.25 * 1.25 - 1.0);
  Eigen::Vector3d back;
  EXPECT_TRUE(camera.unproject(Eigen::Vector2d(640 + 400 * (max_radius - 1e-6), 400), &back));
  EXPECT_FALSE(camera.unproject(Eigen::Vector2d(640 + 400 * (max_radius + 1e-6), 400), &back));

  const MeiCamera below_one(0.5, 400, 400, 640, 400);  // limit: cos(angle) = -0.5, 120 degrees
  EXPECT_TRUE(below_one.project(ray(2.0 * M_PI / 3.0 - 1e-3), &pixel));
  EXPECT_FALSE(below_one.project(ray(2.0 * M_PI / 3.0 + 1e-3), &pixel));
}

TEST(MeiCameraTest, StopsWhereTheDistortionFoldsBack) {
  // With k1 = -1 alone, x_d = x - x^3 has its maximum at x = 1 / sqrt(3).
  const MeiCamera camera((MeiCamera::Parameters() << 0.0, 100, 100, 0, 0, -1.0, 0, 0, 0).finished());
  EXPECT_NEAR(camera.distortion().maxRadius(), 1.0 / std::sqrt(3.0), 1e-12);
  Eigen::Vector2d pixel;
  EXPECT_TRUE(camera.project(Eigen::Vector3d(0.57, 0.0, 1.0), &pixel));
  EXPECT_FALSE(camera.project(Eigen::Vector3d(0.58, 0.0, 1.0), &pixel));
  Eigen::Vector3d ray;
  const double largest = 100.0 * (2.0 / (3.0 * std::sqrt(3.0)));
  EXPECT_TRUE(camera.unproject(Eigen::Vector2d(largest - 1e-3, 0.0), &ray));
  EXPECT_FALSE(camera.unproject(Eigen::Vector2d(largest + 1e-3, 0.0), &ray));
}

TEST(MeiCameraTest, RejectsParametersOutsideItsDomain) {
  MeiCamera::Parameters p = golfCamera().parameters();
  p[0] = -0.1;
  EXPECT_THROW(MeiCamera{p}, std::invalid_argument);
  p[0] = 1.0;
  p[1] = 0.0;
  EXPECT_THROW(MeiCamera{p}, std::invalid_argument);
}

}  // namespace
}  // namespace vcharge
