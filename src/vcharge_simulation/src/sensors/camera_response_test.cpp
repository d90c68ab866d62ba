#include "vcharge_simulation/sensors/camera_response.h"

#include <cmath>

#include <gtest/gtest.h>
#include <opencv2/core.hpp>

namespace vcharge {
namespace {

TEST(CameraResponseTest, LightFromGrayInvertsGrayFromLight) {
  const CameraResponse response;
  for (int gray = 0; gray <= 255; ++gray) {
    EXPECT_NEAR(response.grayFromLight(response.lightFromGray(gray)), gray, 1e-6);
  }
}

TEST(CameraResponseTest, NoiseDependsOnSeedCameraAndFrameOnly) {
  const CameraResponse response;
  const cv::Mat clean(40, 60, CV_8UC1, cv::Scalar(90));
  const cv::Mat first = response.addNoise(clean, 1, 0, 0);
  EXPECT_EQ(cv::norm(first, response.addNoise(clean, 1, 0, 0), cv::NORM_INF), 0.0);
  EXPECT_GT(cv::norm(first, response.addNoise(clean, 2, 0, 0), cv::NORM_INF), 0.0);
  EXPECT_GT(cv::norm(first, response.addNoise(clean, 1, 1, 0), cv::NORM_INF), 0.0);
  EXPECT_GT(cv::norm(first, response.addNoise(clean, 1, 0, 1), cv::NORM_INF), 0.0);
}

TEST(CameraResponseTest, NoiseHasTheVarianceOfPhotonsAndReadout) {
  const CameraResponse response;
  for (const int gray : {40, 90, 160}) {
    const cv::Mat noisy = response.addNoise(cv::Mat(200, 300, CV_8UC1, cv::Scalar(gray)), 7, 0, 0);
    cv::Scalar mean, deviation;
    cv::meanStdDev(noisy, mean, deviation);
    const double light = response.lightFromGray(gray);
    const double slope = (response.grayFromLight(light + 1e-5) - response.grayFromLight(light - 1e-5)) / 2e-5;
    const double exposed = CameraResponse::kExposure * light;
    const double sigma = slope / CameraResponse::kExposure *
                         std::sqrt(CameraResponse::kPhotonNoise * exposed +
                                   CameraResponse::kReadNoise * CameraResponse::kReadNoise);
    EXPECT_NEAR(mean[0], gray, 0.15);
    // Rounding to whole gray levels adds a variance of 1/12.
    EXPECT_NEAR(deviation[0], std::sqrt(sigma * sigma + 1.0 / 12.0), 0.06 * sigma + 0.02);
  }
}

TEST(CameraResponseTest, GainBrightens) {
  const CameraResponse response;
  const cv::Mat clean(50, 50, CV_8UC1, cv::Scalar(90));
  EXPECT_NEAR(cv::mean(response.addNoise(clean, 1, 0, 0, 2.0))[0],
              response.grayFromLight(2.0 * response.lightFromGray(90)), 0.5);
  EXPECT_NEAR(cv::mean(response.expose(clean, 2.0))[0],
              response.grayFromLight(2.0 * response.lightFromGray(90)), 0.5);
  EXPECT_EQ(cv::mean(response.expose(clean, 1.0))[0], 90.0);
}

}  // namespace
}  // namespace vcharge
