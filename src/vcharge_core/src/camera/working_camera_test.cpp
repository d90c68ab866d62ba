#include "vcharge_core/camera/working_camera.h"

#include <cmath>

#include <gtest/gtest.h>

#include "vcharge_core/camera/ray_table.h"

namespace vcharge {
namespace {

constexpr double kFieldOfView = 3.2289;
const cv::Size kSize(1280, 800);

MeiCamera golfCamera() {
  return MeiCamera(
      (MeiCamera::Parameters() << 1.158, 895.5, 894.7, 649.6, 398.7, -0.3308, 0.0865, -0.00068, -3.6e-5)
          .finished());
}

/// A gray level that varies smoothly with the direction of the ray.
double skyLevel(const Eigen::Vector3d& ray) {
  return 128.0 + 60.0 * std::sin(9.0 * ray.x()) * std::cos(7.0 * ray.y());
}

TEST(WorkingCameraTest, KeepsXiAndDropsDistortion) {
  const WorkingCamera working(golfCamera(), kSize, kFieldOfView, cv::Mat());
  EXPECT_EQ(working.size(), cv::Size(640, 400));
  EXPECT_DOUBLE_EQ(working.model().xi(), 1.158);
  EXPECT_TRUE(working.model().distortion().isZero());
  EXPECT_DOUBLE_EQ(working.model().u0(), (649.6 + 0.5) * 0.5 - 0.5);
  EXPECT_DOUBLE_EQ(working.model().gamma1(), 0.5 * 895.5);
}

TEST(WorkingCameraTest, UndistortedImageShowsTheSameRays) {
  const std::vector<CameraModel> cameras = {
      golfCamera(),
      KannalaBrandtCamera(
          (KannalaBrandtCamera::Parameters() << 330, 331, 640, 400, 0.03, -0.01, 2e-3, -4e-4).finished()),
      PinholeCamera((PinholeCamera::Parameters() << 600, 610, 640, 400, -0.2, 0.03, 1e-3, 5e-4).finished())};
  for (const CameraModel& camera : cameras) {
    cv::Mat image(kSize, CV_8UC1, cv::Scalar(0));
    for (int y = 0; y < kSize.height; ++y) {
      for (int x = 0; x < kSize.width; ++x) {
        Eigen::Vector3d ray;
        if (camera.unproject(Eigen::Vector2d(x, y), &ray)) {
          image.at<uint8_t>(y, x) = cv::saturate_cast<uint8_t>(skyLevel(ray));
        }
      }
    }
    const WorkingCamera working(camera, kSize, kFieldOfView, cv::Mat());
    const cv::Mat undistorted = working.undistort(image);
    const RayTable rays(working.model(), working.size(), kFieldOfView);
    int compared = 0;
    for (int y = 0; y < working.size().height; ++y) {
      for (int x = 0; x < working.size().width; ++x) {
        if (working.validMask().at<uint8_t>(y, x) == 0) {
          continue;
        }
        // Gray levels are rounded twice.
        ASSERT_NEAR(undistorted.at<uint8_t>(y, x), skyLevel(rays.ray(x, y).cast<double>()), 1.6)
            << camera.name() << " at " << x << ", " << y;
        ++compared;
      }
    }
    EXPECT_GT(compared, 150000) << camera.name();
  }
}

TEST(WorkingCameraTest, PatternFinerThanTheWorkingPixelsBecomesGray) {
  cv::Mat image(kSize, CV_8UC1);
  for (int y = 0; y < kSize.height; ++y) {
    for (int x = 0; x < kSize.width; ++x) {
      image.at<uint8_t>(y, x) = (x + y) % 2 == 0 ? 40 : 200;
    }
  }
  WorkingCameraOptions options;
  for (const double scale : {0.25, 0.3, 0.4}) {
    options.image_scale = scale;
    const WorkingCamera working(golfCamera(), kSize, kFieldOfView, cv::Mat(), options);
    cv::Mat mean, deviation;
    cv::meanStdDev(working.undistort(image), mean, deviation, working.validMask());
    EXPECT_NEAR(mean.at<double>(0), 120.0, 1.0) << scale;
    EXPECT_LT(deviation.at<double>(0), 1.0) << scale;
  }
}

TEST(WorkingCameraTest, AveragedPixelsShowTheSameRaysAndNothingMasked) {
  // Pixels beside the mask are bright: a result that uses masked pixels would be too bright.
  cv::Mat image(kSize, CV_8UC1, cv::Scalar(255));
  cv::Mat mask(kSize, CV_8UC1, cv::Scalar(0));
  for (int y = 0; y < kSize.height; ++y) {
    for (int x = 0; x < kSize.width; ++x) {
      Eigen::Vector3d ray;
      if (x + 2 * y < 1500 && golfCamera().unproject(Eigen::Vector2d(x, y), &ray)) {
        image.at<uint8_t>(y, x) = cv::saturate_cast<uint8_t>(skyLevel(ray));
        mask.at<uint8_t>(y, x) = 255;
      }
    }
  }
  WorkingCameraOptions options;
  for (const double scale : {0.2, 0.3}) {
    options.image_scale = scale;
    const WorkingCamera working(golfCamera(), kSize, kFieldOfView, mask, options);
    const cv::Mat undistorted = working.undistort(image);
    const RayTable rays(working.model(), working.size(), kFieldOfView);
    int compared = 0;
    for (int y = 0; y < working.size().height; ++y) {
      for (int x = 0; x < working.size().width; ++x) {
        if (working.validMask().at<uint8_t>(y, x) != 0) {
          ASSERT_NEAR(undistorted.at<uint8_t>(y, x), skyLevel(rays.ray(x, y).cast<double>()), 1.6)
              << scale << " at " << x << ", " << y;
          ++compared;
        }
      }
    }
    EXPECT_GT(compared, static_cast<int>(3e5 * scale * scale)) << scale;
  }
}

TEST(WorkingCameraTest, MaskAndFieldOfViewLimitTheValidPixels) {
  cv::Mat mask(kSize, CV_8UC1, cv::Scalar(255));
  mask(cv::Rect(0, 600, 1280, 200)).setTo(0);
  const double narrow = 1.2;
  const WorkingCamera working(golfCamera(), kSize, narrow, mask);
  int valid = 0;
  for (int y = 0; y < working.size().height; ++y) {
    for (int x = 0; x < working.size().width; ++x) {
      if (working.validMask().at<uint8_t>(y, x) == 0) {
        continue;
      }
      Eigen::Vector3d ray;
      ASSERT_TRUE(working.model().unproject(Eigen::Vector2d(x, y), &ray));
      EXPECT_LE(std::acos(ray.z()), 0.5 * narrow + 1e-9);
      EXPECT_LT(working.sensorPixels().at<cv::Vec2f>(y, x)[1], 600.0F);
      ++valid;
    }
  }
  EXPECT_GT(valid, 10000);
}

TEST(WorkingCameraTest, SmallerFocalLengthKeepsMoreOfTheField) {
  WorkingCameraOptions wide;
  wide.focal_scale = 0.6;
  const auto widest = [](const WorkingCamera& working) {
    double min_z = 1.0;
    for (int x = 0; x < working.size().width; ++x) {
      Eigen::Vector3d ray;
      if (working.validMask().at<uint8_t>(200, x) != 0 &&
          working.model().unproject(Eigen::Vector2d(x, 200), &ray)) {
        min_z = std::min(min_z, ray.z());
      }
    }
    return std::acos(min_z);
  };
  EXPECT_LT(widest(WorkingCamera(golfCamera(), kSize, kFieldOfView, cv::Mat())), 1.45);
  EXPECT_GT(widest(WorkingCamera(golfCamera(), kSize, kFieldOfView, cv::Mat(), wide)), 1.5);
}

TEST(WorkingCameraTest, WidthInPixelsHoldsForSensorsOfAllSizesButNeverEnlarges) {
  WorkingCameraOptions by_width, by_scale;
  by_width.width_px = 384;
  for (const int width : {1280, 640, 512, 384, 320}) {
    const cv::Size size(width, width * 5 / 8);
    by_scale.image_scale = std::min(1.0, 384.0 / width);
    const MeiCamera::Parameters p = golfCamera().parameters();
    const double ratio = width / 1280.0;
    const MeiCamera camera(p[0], p[1] * ratio, p[2] * ratio, p[3] * ratio, p[4] * ratio);
    const WorkingCamera working(camera, size, kFieldOfView, cv::Mat(), by_width);
    EXPECT_EQ(working.size(), cv::Size(std::min(384, width), std::min(240, width * 5 / 8)));
    const WorkingCamera same(camera, size, kFieldOfView, cv::Mat(), by_scale);
    EXPECT_EQ(working.model().parameters(), same.model().parameters()) << width;
    EXPECT_EQ(cv::norm(working.sensorPixels(), same.sensorPixels(), cv::NORM_INF), 0.0) << width;
  }
}

TEST(WorkingCameraTest, RejectsBadOptionsAndMasks) {
  WorkingCameraOptions options;
  options.width_px = -1;
  EXPECT_THROW(WorkingCamera(golfCamera(), kSize, kFieldOfView, cv::Mat(), options), std::invalid_argument);
  options = WorkingCameraOptions();
  options.image_scale = 0.0;
  EXPECT_THROW(WorkingCamera(golfCamera(), kSize, kFieldOfView, cv::Mat(), options), std::invalid_argument);
  EXPECT_THROW(WorkingCamera(golfCamera(), kSize, kFieldOfView, cv::Mat::zeros(10, 10, CV_8UC1)),
               std::logic_error);
}

TEST(RayTableTest, HoldsTheRayOfEveryPixelInsideTheCone) {
  const MeiCamera camera = golfCamera();
  cv::Mat mask(kSize, CV_8UC1, cv::Scalar(255));
  mask.at<uint8_t>(400, 640) = 0;
  const RayTable table(camera, kSize, 2.0, mask);
  EXPECT_FALSE(table.valid(640, 400));
  EXPECT_EQ(table.ray(640, 400), Eigen::Vector3f::Zero());
  for (int y = 0; y < kSize.height; y += 37) {
    for (int x = 0; x < kSize.width; x += 41) {
      Eigen::Vector3d ray;
      const bool inside = camera.unproject(Eigen::Vector2d(x, y), &ray) && ray.z() >= std::cos(1.0);
      EXPECT_EQ(table.valid(x, y), inside);
      if (inside) {
        EXPECT_LE((table.ray(x, y).cast<double>() - ray).norm(), 1e-7);
      }
    }
  }
}

}  // namespace
}  // namespace vcharge
