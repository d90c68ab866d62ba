#include "light/ground_reflection.h"

#include <cmath>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include "detection/box_world.h"
#include "vcharge_core/camera/ray_table.h"

namespace vcharge {
namespace {

constexpr double kWallDistance_m = 12.0, kWallHeight_m = 4.0;

/// Part of the light that water mirrors, by the cosine of the incident angle.
double fresnel(double cosine) {
  const double refracted = std::sqrt(1.0 - (1.0 - cosine * cosine) / (1.33 * 1.33));
  const double s = (cosine - 1.33 * refracted) / (cosine + 1.33 * refracted);
  const double p = (refracted - 1.33 * cosine) / (refracted + 1.33 * cosine);
  return 0.5 * (s * s + p * p);
}

/// A camera that looks ahead, over ground, at a wall with windows under a bright sky.
class GroundReflectionTest : public ::testing::Test {
 protected:
  GroundReflectionTest()
      : working_(camera_.model, camera_.image_size_px, camera_.field_of_view_rad, camera_.mask, fullSize()),
        rays_(working_.model(), working_.size(), 2.0 * M_PI, working_.validMask()),
        warp_(working_.model(), working_.validMask()),
        rows_(cv::Point(), working_.size()) {}

  static WorkingCameraOptions fullSize() {
    WorkingCameraOptions options;
    options.image_scale = 1.0;
    return options;
  }
  /// Brightness of the wall and the sky.
  static double surroundings(const Eigen::Vector3d& origin, const Eigen::Vector3d& ray) {
    const double range_m = (kWallDistance_m - origin.x()) / ray.x();
    const Eigen::Vector3d at = origin + range_m * ray;
    if (ray.x() <= 0.0 || at.z() > kWallHeight_m) {
      return 220.0;
    }
    const bool is_window =
        std::fmod(std::abs(at.y() + 100.0), 3.0) < 1.5 && std::fmod(at.z() + 1.0, 2.0) < 1.2;
    return is_window ? 20.0 : 120.0;
  }
  /// `mirror`: part of the light that the ground mirrors by the cosine of the incident angle.
  template <typename Mirror>
  cv::Mat takeImage(const RigidTransform& level_from_camera, const Mirror& mirror) const {
    cv::Mat image(working_.size(), CV_8UC1, cv::Scalar(0));
    const Eigen::Vector3d& origin = level_from_camera.translation();
    for (int y = 0; y < image.rows; ++y) {
      for (int x = 0; x < image.cols; ++x) {
        if (!rays_.valid(x, y)) {
          continue;
        }
        Eigen::Vector3d ray = level_from_camera.rotation() * rays_.ray(x, y).cast<double>().normalized();
        double brightness = 0.0;
        if (ray.z() < 0.0) {
          const Eigen::Vector3d ground = origin - origin.z() / ray.z() * ray;
          const double part = mirror(-ray.z());
          ray.z() = -ray.z();
          brightness = (1.0 - part) * 50.0 + part * surroundings(ground, ray);
        } else {
          brightness = surroundings(origin, ray);
        }
        image.at<uint8_t>(y, x) = cv::saturate_cast<uint8_t>(brightness);
      }
    }
    return image;
  }
  PixelPoints groundPoints() const {
    PixelPoints points;
    for (int y = 0; y < rows_.height; ++y) {
      for (int x = 0; x < rows_.width; ++x) {
        const Eigen::Vector3f ray = now_.rotationMatrix().cast<float>() *
                                    (rays_.valid(x, y) ? rays_.ray(x, y) : Eigen::Vector3f::Zero());
        if (ray.z() < -0.1F && ray.x() > 0.6F) {
          points.add(y * rows_.width + x, ray.x(), ray.y(), ray.z(),
                     -ray.z() / static_cast<float>(now_.translation().z()));
        }
      }
    }
    return points;
  }
  /// Part of the ground's pixels that differ by 8 gray levels or more of which at least half is explained.
  double explainedPart(const cv::Mat& now, const cv::Mat& before) const {
    const PixelPoints points = groundPoints();
    const WarpedImage warped = warp_.warp(before, before_.inverse(), now_.translation(), points, 1.0F, rows_);
    cv::Mat difference;
    cv::subtract(now, warped.image, difference, warped.known, CV_32F);
    const cv::Mat asked = cv::abs(difference) >= 8.0;
    const cv::Mat unexplained = unexplainedByReflection(
        warp_, {now, now_}, {before, before_}, {rows_, points, RigidTransform(), difference, 1.0F}, asked);
    EXPECT_EQ(cv::countNonZero((unexplained < 1.0F) & (asked == 0)), 0);
    EXPECT_GE(cv::countNonZero(asked), 300);
    return static_cast<double>(cv::countNonZero(unexplained < 0.5F)) / cv::countNonZero(asked);
  }

  const CameraRig rig_ = makeBoxWorldRig();
  const RigCamera& camera_ = rig_.cameras.front();
  const WorkingCamera working_;
  const RayTable rays_;
  const PointWarp warp_;
  const cv::Rect rows_;
  const RigidTransform now_ = *camera_.vehicle_from_camera;
  const RigidTransform before_ = RigidTransform::planar(-0.5, 0.2, 0.05) * now_;
};

TEST_F(GroundReflectionTest, MirroredWallIsExplained) {
  EXPECT_GE(explainedPart(takeImage(now_, fresnel), takeImage(before_, fresnel)), 0.8);
}

TEST_F(GroundReflectionTest, FilmOfWaterIsExplained) {
  const auto film = [](double cosine) { return 0.5 * fresnel(cosine); };
  EXPECT_GE(explainedPart(takeImage(now_, film), takeImage(before_, film)), 0.7);
}

TEST_F(GroundReflectionTest, MoverIsNotExplained) {
  const auto dry = [](double) { return 0.0; };
  for (const double brightness : {0.0, 90.0, 200.0}) {
    cv::Mat now = takeImage(now_, dry);
    cv::circle(now, cv::Point(rows_.width / 2, 2 * rows_.height / 3), rows_.height / 12,
               cv::Scalar(brightness), cv::FILLED);
    // Cells have changed if 40 % of their pixels have.
    EXPECT_LE(explainedPart(now, takeImage(before_, dry)), 0.3) << brightness;
  }
}

TEST_F(GroundReflectionTest, MirrorThatIsBrighterThanWaterIsNotExplained) {
  const auto polished = [](double cosine) { return cosine > 0.5 ? 0.7 : 0.0; };
  EXPECT_LE(explainedPart(takeImage(now_, polished), takeImage(before_, polished)), 0.1);
}

}  // namespace
}  // namespace vcharge
