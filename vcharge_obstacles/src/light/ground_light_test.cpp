#include "light/ground_light.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "detection/box_world.h"

namespace vcharge {
namespace {

constexpr double kStep_m = 0.25;

/// Noise as of the ground's texture, in the light of lamps at the vehicle.
class GroundLightTest : public ::testing::Test {
 protected:
  GroundLightTest()
      : working_(camera_.model, camera_.image_size_px, camera_.field_of_view_rad, camera_.mask),
        rays_(working_, *camera_.vehicle_from_camera, grid_),
        light_(rays_) {}

  /// `lamps`: how much brighter the middle of the image is than its sides.
  cv::Mat takeImage(double lamps) {
    cv::Mat image(working_.size(), CV_8UC1);
    std::normal_distribution<double> texture(0.0, 3.0);
    for (int y = 0; y < image.rows; ++y) {
      for (int x = 0; x < image.cols; ++x) {
        const double aside = (x - 0.5 * image.cols) / (0.25 * image.cols);
        const double brightness = 60.0 * (1.0 + lamps * std::exp(-aside * aside));
        image.at<uint8_t>(y, x) = cv::saturate_cast<uint8_t>(brightness + texture(generator_));
      }
    }
    return image;
  }
  cv::Mat drive(int num_images, double lamps) {
    cv::Mat result;
    for (int i = 0; i < num_images; ++i) {
      result = light_.even(takeImage(lamps), RigidTransform::planar(kStep_m * i, 0.0, 0.0));
    }
    return result;
  }
  /// Mean brightness of the ground in the middle of the image over that at its sides.
  double unevenness(const cv::Mat& image) const {
    const int width = image.cols / 8, y = 3 * image.rows / 4, height = image.rows / 8;
    const auto meanFrom = [&](int x) { return cv::mean(image(cv::Rect(x, y, width, height)))[0]; };
    return meanFrom((image.cols - width) / 2) / meanFrom(image.cols / 8);
  }

  const RigCamera camera_ = makeBoxWorldRig().cameras.front();
  const WorkingCamera working_;
  const PolarGrid grid_{PolarGridOptions()};
  const PixelRays rays_;
  GroundLight light_;
  std::mt19937 generator_{3};
};

TEST_F(GroundLightTest, LightOfLampsBecomesEven) {
  EXPECT_GT(unevenness(takeImage(1.0)), 1.5);
  EXPECT_NEAR(unevenness(drive(40, 1.0)), 1.0, 0.1);
}

TEST_F(GroundLightTest, SetsInWithoutAJump) {
  double last = unevenness(takeImage(1.0));
  for (int i = 0; i < 20; ++i) {
    const double now = unevenness(light_.even(takeImage(1.0), RigidTransform::planar(kStep_m * i, 0.0, 0.0)));
    EXPECT_LT(now, last + 0.03);
    EXPECT_GT(now, last - 0.15);
    last = now;
  }
}

TEST_F(GroundLightTest, WhatIsNewIsNotLight) {
  cv::Mat even = drive(40, 0.0);
  const cv::Rect person(even.cols / 2, even.rows / 2, 12, 30);
  const double before = cv::mean(even(person))[0];
  cv::Mat image = takeImage(0.0);
  image(person).setTo(20);
  even = light_.even(image, RigidTransform::planar(kStep_m * 40, 0.0, 0.0));
  EXPECT_NEAR(cv::mean(even(person))[0], before / 3.0, 2.0);
}

TEST_F(GroundLightTest, ImagesStayWithoutMotionAndAfterABreak) {
  for (int i = 0; i < 40; ++i) {
    const cv::Mat image = takeImage(1.0);
    EXPECT_EQ(cv::norm(light_.even(image, RigidTransform()), image, cv::NORM_L1), 0.0);
  }
  drive(40, 1.0);
  light_.clear();
  const cv::Mat image = takeImage(1.0);
  EXPECT_EQ(cv::norm(light_.even(image, RigidTransform()), image, cv::NORM_L1), 0.0);
}

}  // namespace
}  // namespace vcharge
