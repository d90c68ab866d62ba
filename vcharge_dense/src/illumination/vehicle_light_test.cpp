#include "illumination/vehicle_light.h"

#include <cmath>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include "reference/plane_sweep_test_support.h"

namespace vcharge {
namespace {

constexpr double kStep_m = 0.2;
constexpr double kShadowLength_m = 1.0, kShadowWidth_m = 1.2;

/// A vehicle with a left camera, whose shadow falls to the left.
class VehicleLightTest : public ::testing::Test {
 protected:
  VehicleLightTest() : in_shadow_(cv::Mat::zeros(kSize, CV_8UC1)) {
    for (int y = 0; y < kSize.height; ++y) {
      for (int x = 0; x < kSize.width; ++x) {
        Eigen::Vector3d ray;
        if (!kCamera.unproject({x, y}, &ray) || (kLeft.rotation() * ray).z() >= 0.0) {
          continue;
        }
        const Eigen::Vector3d down = kLeft.rotation() * ray;
        const Eigen::Vector3d point = down * (kLeft.translation().z() / -down.z());
        in_shadow_.at<uint8_t>(y, x) =
            std::abs(point.x()) < kShadowLength_m && point.y() < kShadowWidth_m ? 255 : 0;
      }
    }
    cv::Mat wide, narrow;
    cv::dilate(in_shadow_, wide, cv::Mat::ones(5, 5, CV_8UC1));
    cv::erode(in_shadow_, narrow, cv::Mat::ones(5, 5, CV_8UC1));
    edge_ = wide & ~narrow;
    edge_(cv::Rect(0, kSize.height - 8, kSize.width, 8)).setTo(0);
  }

  RigidTransform poseAt(double path_m, double yaw_rad = 0.0) const {
    return RigidTransform(Eigen::Quaterniond(Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ())),
                          Eigen::Vector3d(path_m, 0.0, 0.0)) *
           kLeft;
  }
  cv::Mat render(const RigidTransform& pose, bool with_shadow) const {
    cv::Mat image = scene_.render(kCamera, kSize, pose, 1.0);
    if (with_shadow) {
      cv::Mat dark;
      image.convertTo(dark, CV_8U, 0.45);
      dark.copyTo(image, in_shadow_);
    }
    return image;
  }
  /// Drives straight on and returns the last image without the light.
  cv::Mat drive(int num_images, bool with_shadow) {
    cv::Mat result;
    for (int i = 0; i < num_images; ++i) {
      result = light_.removeFrom(render(poseAt(kStep_m * i), with_shadow), poseAt(kStep_m * i));
    }
    return result;
  }
  /// Mean correlation of the windows across the shadow's edge with those of an image without shadow.
  double correlationAtEdge(const cv::Mat& image, const cv::Mat& without_shadow) const {
    double sum = 0.0;
    for (int y = 3; y + 3 < kSize.height; ++y) {
      for (int x = 3; x + 3 < kSize.width; ++x) {
        if (edge_.at<uint8_t>(y, x) != 0) {
          const cv::Rect window(x - 3, y - 3, 7, 7);
          cv::Mat score;
          cv::matchTemplate(image(window), without_shadow(window), score, cv::TM_CCOEFF_NORMED);
          sum += score.at<float>(0);
        }
      }
    }
    return sum / cv::countNonZero(edge_);
  }

  const AnalyticScene scene_{{{{0, 0, 0}, {0, 0, 1}}}, 5};
  cv::Mat in_shadow_, edge_;
  VehicleLight light_{kCamera, allValid(), kLeft};
};

TEST_F(VehicleLightTest, WindowsAcrossTheEdgeOfTheShadowShowTheGroundAgain) {
  constexpr int kImages = 30;
  const cv::Mat result = drive(kImages, true);
  const RigidTransform pose = poseAt(kStep_m * (kImages - 1));
  const cv::Mat lit = render(pose, false), shaded = render(pose, true);
  ASSERT_GT(cv::countNonZero(edge_), 200);
  const double before = correlationAtEdge(shaded, lit), after = correlationAtEdge(result, lit);
  RecordProperty("before", std::to_string(before));
  RecordProperty("after", std::to_string(after));
  EXPECT_LT(before, 0.6);
  EXPECT_GT(after, 0.5 * (1.0 + before));
}

TEST_F(VehicleLightTest, ImagesWithoutOwnLightHardlyChange) {
  constexpr int kImages = 30;
  const cv::Mat image = render(poseAt(kStep_m * (kImages - 1)), false);
  EXPECT_LT(cv::norm(drive(kImages, false), image, cv::NORM_L1) / static_cast<double>(image.total()), 0.5);
}

TEST_F(VehicleLightTest, LightIsForgottenAfterTurnsAndBreaks) {
  drive(30, true);
  cv::Mat image, result;
  for (int i = 0; i < 20; ++i) {
    const RigidTransform pose = poseAt(6.0, 0.05 * i);
    image = render(pose, true);
    result = light_.removeFrom(image, pose);
  }
  EXPECT_EQ(cv::norm(result, image, cv::NORM_L1), 0.0);
  drive(30, true);
  light_.clear();
  image = render(poseAt(0.0), true);
  EXPECT_EQ(cv::norm(light_.removeFrom(image, poseAt(0.0)), image, cv::NORM_L1), 0.0);
}

TEST_F(VehicleLightTest, WithoutMotionNothingIsLight) {
  const cv::Mat image = render(poseAt(0.0), true);
  for (int i = 0; i < 30; ++i) {
    EXPECT_EQ(cv::norm(light_.removeFrom(image, poseAt(0.0)), image, cv::NORM_L1), 0.0);
  }
}

}  // namespace
}  // namespace vcharge
