#include "ground/point_warp.h"

#include <gtest/gtest.h>

namespace vcharge {
namespace {

constexpr double kFocal_px = 50.0;
const cv::Size kSize(40, 30);
const MeiCamera kPinhole(0.0, kFocal_px, kFocal_px, 19.5, 14.5);

/// Points on the plane at this distance in front of the camera, one per pixel.
PixelPoints planeAt(double distance_m) {
  PixelPoints points;
  points.reserve(static_cast<size_t>(kSize.area()));
  for (int y = 0; y < kSize.height; ++y) {
    for (int x = 0; x < kSize.width; ++x) {
      points.add(y * kSize.width + x, static_cast<float>((x - kPinhole.u0()) / kFocal_px),
                 static_cast<float>((y - kPinhole.v0()) / kFocal_px), 1.0F,
                 static_cast<float>(1.0 / distance_m));
    }
  }
  return points;
}

class PointWarpTest : public ::testing::Test {
 protected:
  PointWarpTest() : before_(kSize, CV_8UC1), valid_(kSize, CV_8UC1, cv::Scalar(255)) {
    cv::RNG(1).fill(before_, cv::RNG::UNIFORM, 0, 256);
  }

  /// Expects that the older image shows pixel (x, y) at (x + dx, y + dy), or nothing outside of it.
  void expectShift(const WarpedImage& warped, int dx, int dy) const {
    for (int y = 0; y < kSize.height; ++y) {
      for (int x = 0; x < kSize.width; ++x) {
        const cv::Point from(x + dx, y + dy);
        const bool is_inside =
            from.x > 0 && from.y > 0 && from.x + 2 < kSize.width && from.y + 2 < kSize.height;
        if (is_inside) {
          ASSERT_EQ(warped.known.at<uint8_t>(y, x), 255) << x << ", " << y;
          ASSERT_NEAR(warped.image.at<uint8_t>(y, x), before_.at<uint8_t>(from), 1) << x << ", " << y;
          ASSERT_EQ(warped.nearest.at<int32_t>(y, x), from.y * kSize.width + from.x);
        } else if (!cv::Rect(-1, -1, kSize.width + 2, kSize.height + 2).contains(from)) {
          ASSERT_EQ(warped.known.at<uint8_t>(y, x), 0) << x << ", " << y;
          ASSERT_EQ(warped.nearest.at<int32_t>(y, x), -1);
        }
      }
    }
  }

  cv::Mat before_, valid_;
  const cv::Rect all_{cv::Point(), kSize};
};

TEST_F(PointWarpTest, ShiftsAPlaneByItsParallax) {
  // The older camera was 0.2 m to the left and 0.08 m above: at 2 m that is 5 and 2 pixels.
  const RigidTransform before_from_now(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0.2, 0.08, 0.0));
  const PointWarp warp(kPinhole, valid_);
  expectShift(warp.warp(before_, before_from_now, Eigen::Vector3d::Zero(), planeAt(2.0), 1.0F, all_), 5, 2);
  expectShift(warp.warp(before_, before_from_now, Eigen::Vector3d::Zero(), planeAt(4.0), 2.0F, all_), 5, 2);
  expectShift(warp.warp(before_, before_from_now, Eigen::Vector3d::Zero(), planeAt(2.0), 0.0F, all_), 0, 0);
}

TEST_F(PointWarpTest, AUsedImageKeepsNothing) {
  const RigidTransform before_from_now(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0.2, 0.08, 0.0));
  const PointWarp warp(kPinhole, valid_);
  WarpedImage warped =
      warp.warp(before_, RigidTransform(), Eigen::Vector3d::Zero(), planeAt(2.0), 1.0F, all_);
  const cv::Mat was_known = warped.known.clone();
  warp.warpAgain(before_, before_from_now, Eigen::Vector3d::Zero(), planeAt(2.0), 1.0F, all_, &warped);
  expectShift(warped, 5, 2);
  const cv::Mat seen_before_alone = was_known & ~warped.known;
  EXPECT_GT(cv::countNonZero(seen_before_alone), 100);
  EXPECT_EQ(cv::countNonZero(warped.image & seen_before_alone), 0);
}

TEST_F(PointWarpTest, RaysMayStartElsewhere) {
  // Rays that start 0.2 m to the right of the camera.
  const PointWarp warp(kPinhole, valid_);
  expectShift(warp.warp(before_, RigidTransform(), Eigen::Vector3d(0.2, 0.0, 0.0), planeAt(2.0), 1.0F, all_),
              5, 0);
}

TEST_F(PointWarpTest, KnowsNothingBehindTheCameraOrWhereImagesAreMasked) {
  const RigidTransform turned(rotationFromYawPitchRoll(0.0, 3.14159, 0.0), Eigen::Vector3d::Zero());
  const PointWarp whole(kPinhole, valid_);
  EXPECT_EQ(
      cv::countNonZero(whole.warp(before_, turned, Eigen::Vector3d::Zero(), planeAt(2.0), 1.0F, all_).known),
      0);
  valid_.colRange(0, 20).setTo(0);
  const PointWarp half(kPinhole, valid_);
  const WarpedImage warped =
      half.warp(before_, RigidTransform(), Eigen::Vector3d::Zero(), planeAt(2.0), 1.0F, all_);
  EXPECT_EQ(cv::countNonZero(warped.known.colRange(0, 19)), 0);
  EXPECT_EQ(cv::countNonZero(warped.known(cv::Rect(21, 1, 17, 27))), 17 * 27);
}

TEST_F(PointWarpTest, WarpsTheRowsItIsAskedFor) {
  const cv::Rect rows(0, 10, kSize.width, 5);
  PixelPoints points;
  points.add(12 * kSize.width + 7, static_cast<float>((7 - kPinhole.u0()) / kFocal_px),
             static_cast<float>((12 - kPinhole.v0()) / kFocal_px), 1.0F, 0.5F);
  const WarpedImage warped =
      PointWarp(kPinhole, valid_)
          .warp(before_, RigidTransform(), Eigen::Vector3d::Zero(), points, 1.0F, rows);
  ASSERT_EQ(warped.image.size(), rows.size());
  EXPECT_EQ(cv::countNonZero(warped.known), 1);
  EXPECT_NEAR(warped.image.at<uint8_t>(2, 7), before_.at<uint8_t>(12, 7), 1);
}

}  // namespace
}  // namespace vcharge
