#include "ground/plane_fit.h"

#include <gtest/gtest.h>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

namespace vcharge {
namespace {

constexpr int kSize_px = 60;

cv::Mat noise(int seed) {
  cv::Mat image(kSize_px, kSize_px, CV_8UC1);
  cv::RNG(static_cast<uint64_t>(seed)).fill(image, cv::RNG::UNIFORM, 60, 180);
  cv::blur(image, image, cv::Size(3, 3));
  return image;
}

cv::Mat known() {
  return {kSize_px, kSize_px, CV_8UC1, cv::Scalar(255)};
}

cv::Mat fitOf(const cv::Mat& now, const cv::Mat& on_ground, const cv::Mat& on_raised,
              const cv::Mat& knows_raised = known()) {
  cv::Mat keeps_texture;
  cv::Mat fits = fitPlanes(now, on_ground, on_raised, knows_raised, &keeps_texture);
  EXPECT_EQ(cv::countNonZero(keeps_texture != keepsTexture(now, on_ground)), 0);
  return fits;
}

double fractionOf(const cv::Mat& fits, uint8_t value) {
  return static_cast<double>(cv::countNonZero(fits == value)) / fits.size().area();
}

TEST(PlaneFitTest, WhatFitsTheGroundIsGroundWhateverTheLight) {
  const cv::Mat now = noise(1);
  cv::Mat darker;
  now.convertTo(darker, CV_8U, 0.6, 5.0);
  EXPECT_GT(fractionOf(fitOf(now, darker, noise(2)), PlaneFit::kGround), 0.99);
}

TEST(PlaneFitTest, WhatFitsThePlaneAboveOrNeitherIsOther) {
  const cv::Mat now = noise(1);
  EXPECT_GT(fractionOf(fitOf(now, noise(2), now), PlaneFit::kOther), 0.99);
  const cv::Mat neither = fitOf(now, noise(2), noise(3));
  EXPECT_GT(fractionOf(neither, PlaneFit::kOther), 0.6);
  EXPECT_LT(fractionOf(neither, PlaneFit::kGround), 0.02)
      << "small windows fit by chance, larger ones do not";
}

TEST(PlaneFitTest, WhatFitsBothPlanesOrHasNoTextureIsUndecided) {
  const cv::Mat now = noise(1), flat(kSize_px, kSize_px, CV_8UC1, cv::Scalar(100));
  EXPECT_EQ(fractionOf(fitOf(now, now, now), PlaneFit::kUndecided), 1.0);
  EXPECT_EQ(fractionOf(fitOf(flat, flat, noise(2)), PlaneFit::kUndecided), 1.0);
}

TEST(PlaneFitTest, GroundNeedsAPlaneAboveToCompareWith) {
  const cv::Mat now = noise(1);
  EXPECT_EQ(fractionOf(fitOf(now, now, noise(2), cv::Mat::zeros(now.size(), CV_8UC1)), PlaneFit::kGround),
            0.0);
}

TEST(PlaneFitTest, TextureIsKeptInWhateverLight) {
  const cv::Mat now = noise(1), flat(kSize_px, kSize_px, CV_8UC1, cv::Scalar(100));
  cv::Mat darker;
  now.convertTo(darker, CV_8U, 0.4, 3.0);
  EXPECT_EQ(fractionOf(keepsTexture(now, darker), 255), 1.0);
  // Images of cv::RNG with successive seeds correlate. Windows of independent ones reach the bound in 3 %.
  EXPECT_LT(fractionOf(keepsTexture(now, noise(12345)), 255), 0.1);
  EXPECT_EQ(fractionOf(keepsTexture(flat, now), 255), 0.0) << "a plain body came";
  EXPECT_EQ(fractionOf(keepsTexture(flat, flat), 255), 0.0)
      << "plain ground cannot be told from a plain body";
}

TEST(PlaneFitTest, ImagesSmallerThanAWindowAreCompared) {
  const cv::Mat now = noise(1)(cv::Rect(0, 0, 3, 2)).clone();
  EXPECT_EQ(fitOf(now, now, now, known()(cv::Rect(0, 0, 3, 2))).size(), now.size());
}

}  // namespace
}  // namespace vcharge
