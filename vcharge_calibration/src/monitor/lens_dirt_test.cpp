#include "monitor/lens_dirt.h"

#include <cmath>
#include <memory>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include "testing/analytic_drive.h"

namespace vcharge {
namespace {

constexpr double kStep_m = 0.5, kLeg_m = 20.0;
constexpr double kSpotRadius = 0.03;  // as a fraction of the image's width
constexpr double kClean = 0.001;

/// A spot in an image, and its brightness over that of what it hides.
struct Spot {
  double x, y;  // as fractions of the image's size
  double factor;
};

/// A camera over ground with noise as texture.
class LensDirtTest : public ::testing::Test {
 protected:
  LensDirtTest() : rig_(testing::makeAnalyticDrive(1, 0.0).rig), dirt_(rig_->cameras[1]) {}

  /// Turns to a direction and drives a leg. Spots stay in place in the images.
  void drive(double yaw_rad, const std::vector<Spot>& spots, double light = 1.0) {
    const cv::Size size = rig_->cameras[1].image_size_px;
    cv::Mat factor(size, CV_32FC1, cv::Scalar(light));
    for (const Spot& spot : spots) {
      cv::circle(factor, cv::Point2d(spot.x * size.width, spot.y * size.height),
                 cvRound(kSpotRadius * size.width), cv::Scalar(light * spot.factor), cv::FILLED);
    }
    for (double at_m = 0.0; at_m < kLeg_m; at_m += kStep_m) {
      cv::Mat image(size, CV_32FC1), pixels;
      random_.fill(image, cv::RNG::NORMAL, 80.0, 60.0);
      cv::blur(image, image, cv::Size(5, 5));
      cv::multiply(image, factor, pixels, 1.0, CV_8U);
      x_m_ += kStep_m;
      dirt_.add(pixels, RigidTransform::planar(x_m_, 0.0, yaw_rad));
    }
  }
  const std::shared_ptr<const CameraRig> rig_;
  LensDirt dirt_;
  double x_m_ = 0.0;
  cv::RNG random_{1};
};

TEST_F(LensDirtTest, GroundIsClean) {
  EXPECT_EQ(dirt_.part(), 0.0);
  drive(0.0, {});
  drive(0.5 * M_PI, {}, 0.7);
  drive(M_PI, {}, 1.2);
  EXPECT_LE(dirt_.part(), kClean);
}

TEST_F(LensDirtTest, SpotsThatStayInAllDirectionsAreDirt) {
  const std::vector<Spot> spots{{0.4, 0.6, 0.6}, {0.6, 0.7, 1.5}};
  drive(0.0, spots);
  EXPECT_EQ(dirt_.part(), 0.0) << "light of the vehicle stays in one direction";
  drive(0.5 * M_PI, spots);
  EXPECT_GE(dirt_.part(), 0.01);
  EXPECT_LE(dirt_.part(), 0.04);
}

TEST_F(LensDirtTest, ShadowThatTurnsIsNoDirt) {
  drive(0.0, {{0.4, 0.6, 0.5}});
  drive(0.5 * M_PI, {{0.6, 0.6, 0.5}});
  drive(M_PI, {{0.5, 0.7, 0.5}});
  EXPECT_LE(dirt_.part(), kClean);
}

TEST_F(LensDirtTest, DirtThatComesIsFoundAndDirtThatGoesIsForgotten) {
  const std::vector<Spot> spots{{0.4, 0.6, 0.6}};
  for (int lap = 0; lap < 3; ++lap) {
    drive(0.0, {});
    drive(M_PI, {});
  }
  EXPECT_LE(dirt_.part(), kClean);
  drive(0.0, spots);
  drive(M_PI, spots);
  EXPECT_GE(dirt_.part(), 0.005);
  for (int lap = 0; lap < 2; ++lap) {
    drive(0.0, {});
    drive(M_PI, {});
  }
  EXPECT_LE(dirt_.part(), kClean);
}

TEST_F(LensDirtTest, StandingTellsNothing) {
  cv::Mat pixels(rig_->cameras[1].image_size_px, CV_8UC1, cv::Scalar(80));
  cv::circle(pixels, cv::Point(pixels.cols / 2, 2 * pixels.rows / 3), pixels.cols / 30, cv::Scalar(20),
             cv::FILLED);
  for (int i = 0; i < 100; ++i) {
    dirt_.add(pixels, RigidTransform::planar(1.0, 0.0, 0.01 * i));
  }
  EXPECT_EQ(dirt_.part(), 0.0);
}

}  // namespace
}  // namespace vcharge
