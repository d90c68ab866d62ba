#include "vcharge_evaluation/range_truth.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "vcharge_core/camera/ray_table.h"

namespace vcharge {
namespace {

const cv::Size kSize(640, 400);
constexpr double kFieldOfView = 3.2289;

MeiCamera testCamera() {
  return MeiCamera(
      (MeiCamera::Parameters() << 1.158, 447.7, 447.3, 324.5, 199.1, -0.3308, 0.0865, -0.00068, -3.6e-5)
          .finished());
}

/// Range to the plane z = 2 m in front of the camera; NaN beyond 80 degrees.
float rangeToWall(const Eigen::Vector3f& ray) {
  return ray.z() > 0.17F ? 2.0F / ray.z() : std::numeric_limits<float>::quiet_NaN();
}

TEST(RangeTruthTest, ResamplesAPlaneToTheWorkingCamera) {
  const RayTable sensor_rays(testCamera(), kSize, kFieldOfView);
  cv::Mat sensor(kSize, CV_32FC1);
  for (int y = 0; y < kSize.height; ++y) {
    for (int x = 0; x < kSize.width; ++x) {
      sensor.at<float>(y, x) = rangeToWall(sensor_rays.ray(x, y));
    }
  }
  const WorkingCamera working(testCamera(), kSize, kFieldOfView, cv::Mat());
  const RayTable working_rays(working.model(), working.size(), kFieldOfView);
  const cv::Mat truth = resampleRangeTruth(sensor, working);
  int compared = 0;
  for (int y = 0; y < truth.rows; ++y) {
    for (int x = 0; x < truth.cols; ++x) {
      const float expected = rangeToWall(working_rays.ray(x, y));
      if (working.validMask().at<uint8_t>(y, x) != 0 && expected < 8.0F) {
        ASSERT_NEAR(truth.at<float>(y, x), expected, 1e-3F * expected) << x << ", " << y;
        ++compared;
      }
    }
  }
  EXPECT_GT(compared, 30000);
}

TEST(RangeTruthTest, DoesNotMixBothSidesOfAnEdge) {
  cv::Mat sensor(kSize, CV_32FC1, cv::Scalar(2.0));
  sensor.colRange(320, 640).setTo(10.0);
  const cv::Mat truth =
      resampleRangeTruth(sensor, WorkingCamera(testCamera(), kSize, kFieldOfView, cv::Mat()));
  for (int y = 0; y < truth.rows; ++y) {
    for (int x = 0; x < truth.cols; ++x) {
      const float value = truth.at<float>(y, x);
      EXPECT_TRUE(std::isnan(value) || std::abs(value - 2.0F) < 1e-5F || std::abs(value - 10.0F) < 1e-5F)
          << value;
    }
  }
}

TEST(RangeTruthTest, MissingFileIsNoTruth) {
  EXPECT_TRUE(readRangeTruth("/nonexistent", "left", Timestamp::fromNanoseconds(1)).empty());
}

}  // namespace
}  // namespace vcharge
