#include "vcharge_calibration/masks/body_mask_estimator.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include "vcharge_core/base/error.h"
#include "vcharge_core/camera/kannala_brandt_camera.h"

namespace vcharge {
namespace {

const cv::Size kSize(640, 400);
constexpr double kPeriod_s = 0.1;

KannalaBrandtCamera equidistantCamera() {
  KannalaBrandtCamera::Parameters parameters;
  parameters << 190.0, 190.0, 320.0, 200.0, 0.0, 0.0, 0.0, 0.0;
  return KannalaBrandtCamera(parameters);
}

std::shared_ptr<const CameraRig> oneCamera() {
  CameraRig rig;
  RigCamera camera{"left", "camera_left_optical", kSize, equidistantCamera()};
  camera.field_of_view_rad = 3.1;
  rig.cameras.push_back(camera);
  return std::make_shared<const CameraRig>(rig);
}

/// Field of view, or with a larger radius the image circle.
cv::Mat inside(int radius_px = 294) {
  cv::Mat mask = cv::Mat::zeros(kSize, CV_8UC1);
  cv::circle(mask, cv::Point(320, 200), radius_px, cv::Scalar(255), cv::FILLED);
  return mask;
}

/// Body below an arc at the lower border of the image.
cv::Mat body() {
  cv::Mat mask = cv::Mat::zeros(kSize, CV_8UC1);
  for (int y = 0; y < kSize.height; ++y) {
    for (int x = 0; x < kSize.width; ++x) {
      const double u = (x - 320.0) / 320.0;
      mask.at<uint8_t>(y, x) = y > 370.0 - 140.0 * u * u ? 255 : 0;
    }
  }
  return mask;
}

/// Draws a drive: a texture moves through the image with the odometer, which drives a circle. `change` may
/// alter the sharp image of each pose before it is blurred.
class DrawnDrive {
 public:
  using Change = std::function<void(double heading_rad, cv::Mat* image)>;

  double speed_m_per_s = 4.0;
  int num_images = 100;
  bool has_odometry = true;

  BodyMasks masks(const Change& change) const {
    BodyMaskEstimator estimator(oneCamera());
    cv::RNG random(7);
    cv::Mat texture(1024, 1024, CV_32FC1);
    random.fill(texture, cv::RNG::NORMAL, 0.0, 1.0);
    cv::GaussianBlur(texture, texture, cv::Size(), 1.2);
    texture = 110.0 + texture * 60.0;
    for (int i = 0; i < num_images; ++i) {
      const Timestamp stamp = Timestamp::fromNanoseconds(1000000000) + durationFromSeconds(kPeriod_s * i);
      const double way_m = speed_m_per_s * kPeriod_s * i, heading_rad = way_m / 10.0;
      if (has_odometry) {
        VehicleOdometry odometry;
        odometry.stamp = stamp;
        odometry.odom_from_vehicle = RigidTransform(
            Eigen::Quaterniond(Eigen::AngleAxisd(heading_rad, Eigen::Vector3d::UnitZ())),
            Eigen::Vector3d(10.0 * std::sin(heading_rad), 10.0 * (1.0 - std::cos(heading_rad)), 0.0));
        estimator.addOdometry(odometry);
      }
      const int shift_px = static_cast<int>(37.0 * way_m) % (1024 - kSize.width);
      const int row = static_cast<int>(7.0 * way_m) % (1024 - kSize.height);
      cv::Mat image = texture(cv::Rect(shift_px, row, kSize.width, kSize.height)).clone();
      change(heading_rad, &image);
      image.setTo(0.0, inside(304) == 0);
      cv::GaussianBlur(image, image, cv::Size(), 0.7);
      cv::Mat noise(kSize, CV_32FC1), pixels;
      random.fill(noise, cv::RNG::NORMAL, 0.0, 1.5);
      image += noise;
      image.convertTo(pixels, CV_8U);
      estimator.addImage(0, stamp, Image{pixels, nullptr});
    }
    return estimator.result();
  }
};

void drawNothing(double /*heading_rad*/, cv::Mat* /*image*/) {}

void drawBody(double /*heading_rad*/, cv::Mat* image) {
  cv::Mat paint(kSize, CV_32FC1);
  for (int x = 0; x < kSize.width; ++x) {
    paint.col(x).setTo(60.0 + 0.05 * x);
  }
  paint.copyTo(*image, body());
}

double fraction(const cv::Mat& part, const cv::Mat& whole) {
  return static_cast<double>(cv::countNonZero(part & whole)) / cv::countNonZero(whole);
}

void expectBodyHidden(const BodyMasks& masks, const cv::Mat& body = vcharge::body()) {
  const CameraBodyMask& found = masks.cameras.at(0);
  ASSERT_NE(found.verdict, Verdict::kFail) << found.remarks.at(0);
  ASSERT_EQ(found.mask.size(), kSize);
  EXPECT_GE(fraction(found.mask == 0, body & inside()), 0.97);
  EXPECT_LE(fraction(found.mask == 0, inside() & (body == 0)), 0.02);
}

void expectNotEnoughMotion(const BodyMasks& masks) {
  EXPECT_EQ(masks.verdict, Verdict::kFail);
  EXPECT_EQ(masks.cameras.at(0).verdict, Verdict::kFail);
  EXPECT_TRUE(masks.cameras.at(0).mask.empty());
  EXPECT_NE(masks.cameras.at(0).remarks.at(0).find("not enough motion"), std::string::npos);
}

TEST(BodyMaskEstimatorTest, HidesTheBodyAndKeepsTheScene) {
  const BodyMasks masks = DrawnDrive().masks(drawBody);
  EXPECT_EQ(masks.verdict, Verdict::kPass);
  EXPECT_NEAR(masks.distance_m, 39.6, 1.0);
  expectBodyHidden(masks);
}

TEST(BodyMaskEstimatorTest, ThinsOutTheSamplesOfALongDrive) {
  DrawnDrive drive;
  drive.speed_m_per_s = 8.0;
  drive.num_images = static_cast<int>(BodyMaskEstimator::kMaxSamples) + 60;
  const BodyMasks masks = drive.masks(drawBody);
  EXPECT_LE(masks.num_samples, static_cast<int>(BodyMaskEstimator::kMaxSamples));
  EXPECT_GT(masks.num_samples, static_cast<int>(BodyMaskEstimator::kMaxSamples) / 2);
  expectBodyHidden(masks);
}

TEST(BodyMaskEstimatorTest, HidesPaintAboveTheHorizonThatReflectsThingsOfMoreStructureThanTheGround) {
  cv::Mat side = cv::Mat::zeros(kSize, CV_8UC1);
  cv::ellipse(side, cv::Point(0, 200), cv::Size(110, 400), 0.0, 0.0, 360.0, cv::Scalar(255), cv::FILLED);
  expectBodyHidden(DrawnDrive().masks([&](double /*heading_rad*/, cv::Mat* image) {
    image->rowRange(0, 180) = 110.0 + 2.5 * (image->rowRange(0, 180) - 110.0);
    image->rowRange(180, kSize.height) = 110.0 + 0.5 * (image->rowRange(180, kSize.height) - 110.0);
    cv::Mat mirrored;
    cv::flip(*image, mirrored, 1);
    mirrored = 60.0 + 0.2 * mirrored;
    mirrored.copyTo(*image, side);
  }),
                   side);
}

TEST(BodyMaskEstimatorTest, HidesPaintThatReflectsTheMovingScene) {
  expectBodyHidden(DrawnDrive().masks([](double /*heading_rad*/, cv::Mat* image) {
    cv::Mat mirrored;
    cv::flip(*image, mirrored, 0);
    mirrored = 50.0 + 0.25 * mirrored;
    mirrored.copyTo(*image, body());
  }));
}

TEST(BodyMaskEstimatorTest, HidesTheBodyUnderChangingExposure) {
  expectBodyHidden(DrawnDrive().masks([](double heading_rad, cv::Mat* image) {
    drawBody(heading_rad, image);
    *image *= 1.0 + 0.5 * std::sin(5.0 * heading_rad);
  }));
}

TEST(BodyMaskEstimatorTest, HidesNothingWithoutABody) {
  const BodyMasks masks = DrawnDrive().masks(drawNothing);
  ASSERT_EQ(masks.verdict, Verdict::kPass);
  EXPECT_EQ(cv::countNonZero(masks.cameras[0].mask == 0), 0);
  EXPECT_EQ(masks.cameras[0].body_fraction, 0.0);
}

TEST(BodyMaskEstimatorTest, KeepsTheOwnShadow) {
  // Half a circle of headings, over which the shadow turns around the car.
  const BodyMasks masks = DrawnDrive().masks([](double heading_rad, cv::Mat* image) {
    const cv::Point2f low(320.0F + 240.0F * static_cast<float>(std::cos(heading_rad)), 420.0F);
    cv::Mat shadow = cv::Mat::zeros(kSize, CV_8UC1);
    cv::circle(shadow, low, 160, cv::Scalar(255), cv::FILLED);
    cv::Mat dark = 0.4 * *image;
    dark.copyTo(*image, shadow);
  });
  ASSERT_NE(masks.verdict, Verdict::kFail);
  EXPECT_LE(fraction(masks.cameras[0].mask == 0, inside()), 0.005);
}

TEST(BodyMaskEstimatorTest, KeepsUniformAndSaturatedSky) {
  for (const double sky : {180.0, 400.0}) {
    expectBodyHidden(DrawnDrive().masks([&](double heading_rad, cv::Mat* image) {
      // The skyline moves with the scene.
      for (int x = 0; x < kSize.width; ++x) {
        const int height = 100 + static_cast<int>(50.0 * std::sin(0.025 * x + 9.0 * heading_rad));
        image->col(x).rowRange(0, height).setTo(sky);
      }
      drawBody(heading_rad, image);
    }));
  }
}

TEST(BodyMaskEstimatorTest, ReportsDirtWithoutHidingItAsBody) {
  const BodyMasks masks = DrawnDrive().masks([](double heading_rad, cv::Mat* image) {
    drawBody(heading_rad, image);
    cv::circle(*image, cv::Point(240, 160), 12, cv::Scalar(20.0), cv::FILLED);
    cv::circle(*image, cv::Point(400, 120), 10, cv::Scalar(220.0), cv::FILLED);
  });
  expectBodyHidden(masks);
  EXPECT_EQ(masks.verdict, Verdict::kWarn);
  EXPECT_GT(masks.cameras[0].spot_fraction, 0.001);
}

TEST(BodyMaskEstimatorTest, FailsForAStandingDrive) {
  DrawnDrive drive;
  drive.speed_m_per_s = 0.0;
  expectNotEnoughMotion(drive.masks(drawBody));
}

TEST(BodyMaskEstimatorTest, FailsForAShortDrive) {
  DrawnDrive drive;
  drive.num_images = 30;
  expectNotEnoughMotion(drive.masks(drawBody));
}

TEST(BodyMaskEstimatorTest, FailsWithoutOdometry) {
  DrawnDrive drive;
  drive.has_odometry = false;
  expectNotEnoughMotion(drive.masks(drawBody));
}

TEST(BodyMaskEstimatorTest, FailsForACoveredCamera) {
  const BodyMasks masks =
      DrawnDrive().masks([](double /*heading_rad*/, cv::Mat* image) { image->setTo(0.0); });
  EXPECT_EQ(masks.verdict, Verdict::kFail);
  EXPECT_TRUE(masks.cameras[0].mask.empty());
}

TEST(BodyMaskEstimatorTest, SameDriveGivesTheSameMasks) {
  const BodyMasks first = DrawnDrive().masks(drawBody), second = DrawnDrive().masks(drawBody);
  EXPECT_EQ(cv::norm(first.cameras[0].mask, second.cameras[0].mask, cv::NORM_INF), 0.0);
}

TEST(BodyMaskEstimatorTest, RefusesBadInput) {
  EXPECT_THROW(BodyMaskEstimator(std::make_shared<const CameraRig>()), InputError);
  BodyMaskOptions options;
  options.sample_distance_m = 0.0;
  EXPECT_THROW(BodyMaskEstimator(oneCamera(), options), std::invalid_argument);
}

}  // namespace
}  // namespace vcharge
