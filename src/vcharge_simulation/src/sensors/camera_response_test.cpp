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

// Gray value and its standard deviation by the noise model: shot noise of the collected light and read noise,
// both amplified by the gain.
void expectNoise(const cv::Mat& noisy, double light, const Exposure& exposure) {
  const CameraResponse response;
  const double signal = light * exposure.factor * exposure.gain;
  const double slope = (response.grayFromLight(signal + 1e-5) - response.grayFromLight(signal - 1e-5)) / 2e-5;
  const double collected = CameraResponse::kExposure * light * exposure.factor;
  const double sigma = slope * exposure.gain / CameraResponse::kExposure *
                       std::sqrt(CameraResponse::kPhotonNoise * collected +
                                 CameraResponse::kReadNoise * CameraResponse::kReadNoise);
  cv::Scalar mean, deviation;
  cv::meanStdDev(noisy, mean, deviation);
  EXPECT_NEAR(mean[0], response.grayFromLight(signal), 0.15 + 0.1 * sigma);
  // Rounding to whole gray levels adds a variance of 1/12.
  EXPECT_NEAR(deviation[0], std::sqrt(sigma * sigma + 1.0 / 12.0), 0.06 * sigma + 0.02);
}

TEST(CameraResponseTest, NoiseHasTheVarianceOfPhotonsAndReadout) {
  const CameraResponse response;
  const cv::Size size(300, 200);
  for (const int gray : {40, 90, 160}) {
    expectNoise(response.addNoise(cv::Mat(size, CV_8UC1, cv::Scalar(gray)), 7, 0, 0),
                response.lightFromGray(gray), Exposure());
  }
  for (const Exposure& exposure :
       {Exposure{1.0, 1.0}, Exposure{20.0, 1.0}, Exposure{20.0, 4.0}, Exposure{0.5, 16.0}}) {
    // The same gray value, from the less light the longer and the more it is amplified.
    const double light = response.lightFromGray(90) / (exposure.factor * exposure.gain);
    expectNoise(response.addNoise(cv::Mat(size, CV_32FC1, cv::Scalar(light)), 7, 0, 0, exposure), light,
                exposure);
  }
}

TEST(CameraResponseTest, ExposureAndGainBrightenAlike) {
  const CameraResponse response;
  const cv::Mat clean(50, 50, CV_8UC1, cv::Scalar(90));
  const cv::Mat light(50, 50, CV_32FC1, cv::Scalar(response.lightFromGray(90)));
  const double expected = response.grayFromLight(2.0 * response.lightFromGray(90));
  for (const cv::Mat& image : {clean, light}) {
    for (const Exposure& exposure : {Exposure{2.0, 1.0}, Exposure{1.0, 2.0}}) {
      EXPECT_NEAR(cv::mean(response.addNoise(image, 1, 0, 0, exposure))[0], expected, 0.5);
      EXPECT_NEAR(cv::mean(response.expose(image, exposure))[0], expected, 0.5);
    }
    EXPECT_EQ(cv::mean(response.expose(image, Exposure()))[0], 90.0);
  }
}

}  // namespace
}  // namespace vcharge
