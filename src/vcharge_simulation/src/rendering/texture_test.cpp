#include "vcharge_simulation/rendering/texture.h"

#include <cmath>

#include <gtest/gtest.h>

namespace vcharge {
namespace {

cv::Mat checkerboard(int size) {
  cv::Mat image(size, size, CV_8UC1);
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      image.at<uint8_t>(y, x) = (x + y) % 2 == 0 ? 255 : 0;
    }
  }
  return image;
}

TEST(TextureTest, TexelCentresCarryTheTexelsValue) {
  cv::Mat image(3, 5, CV_8UC1);
  for (int i = 0; i < 15; ++i) {
    image.at<uint8_t>(i / 5, i % 5) = static_cast<uint8_t>(17 * i);
  }
  const Texture texture(image, Texture::Border::kClamp);
  for (int y = 0; y < 3; ++y) {
    for (int x = 0; x < 5; ++x) {
      EXPECT_NEAR(texture.sample(static_cast<float>(x) + 0.5F, static_cast<float>(y) + 0.5F, 0.0F),
                  image.at<uint8_t>(y, x) / 255.0, 1e-6);
    }
  }
}

TEST(TextureTest, CoarserLevelsDoNotAlias) {
  const Texture texture(checkerboard(64), Texture::Border::kRepeat);
  double fine = 0.0;
  double coarse = 0.0;
  for (int i = 0; i < 200; ++i) {
    const float x = 7.37F * static_cast<float>(i);
    fine += std::pow(texture.sample(x, 0.5F, 0.0F) - 0.5, 2.0);
    coarse += std::pow(texture.sample(x, 0.5F, 1.5F) - 0.5, 2.0);
  }
  EXPECT_GT(fine / 200, 0.02);
  EXPECT_LT(coarse / 200, 1e-4);
}

TEST(TextureTest, RepeatsWithoutSeam) {
  cv::Mat image(8, 8, CV_8UC1);
  for (int i = 0; i < 64; ++i) {
    image.at<uint8_t>(i / 8, i % 8) = static_cast<uint8_t>(i * 37 % 256);
  }
  const Texture texture(image, Texture::Border::kRepeat);
  EXPECT_FLOAT_EQ(texture.sample(1.3F, 2.7F, 0.0F), texture.sample(1.3F + 8.0F, 2.7F - 16.0F, 0.0F));
}

TEST(TextureTest, FastLog2IsNearLog2) {
  for (float value = 1e-3F; value < 1e3F; value *= 1.07F) {
    EXPECT_NEAR(fastLog2(value), std::log2(value), 0.012);
  }
}

}  // namespace
}  // namespace vcharge
