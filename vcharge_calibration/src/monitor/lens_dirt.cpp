#include "monitor/lens_dirt.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>
#include <opencv2/imgproc.hpp>

namespace vcharge {
namespace {

constexpr int kWidth_px = 288;
// Pixels this near to the rim or to the vehicle are not used.
constexpr int kMargin_px = 2;
// Rays that fall by more than this show ground near the vehicle.
constexpr double kGroundFall = 0.08;
// Angle between a spot and the ground beside it.
constexpr double kBeside_rad = 0.244;
// An image that follows sooner is left out.
constexpr double kLeastStep_m = 0.3;
// Path of a direction that counts, and of all directions in which a spot must be seen.
constexpr double kDirection_m = 5.0, kSeen_m = 15.0;
// Least part of the path in which a spot must be seen.
constexpr double kAgree = 0.67;
// Least contrast of a spot, as logarithm, and its least number of standard deviations.
constexpr float kContrast = 0.12F, kSigmas = 3.0F;
// Path after which the ground is new.
constexpr double kIndependent_m = 0.7;
// Added to gray levels before their logarithm, so that noise of dark pixels stays small.
constexpr double kDark = 4.0;

WorkingCamera workingCamera(const RigCamera& camera) {
  WorkingCameraOptions options;
  options.width_px = std::min(kWidth_px, camera.image_size_px.width);
  return WorkingCamera(camera.model, camera.image_size_px, camera.field_of_view_rad, camera.mask, options);
}

cv::Mat logarithm(const cv::Mat& image) {
  cv::Mat smooth, result;
  cv::blur(image, smooth, cv::Size(3, 3));
  smooth.convertTo(result, CV_32F, 1.0, kDark);
  cv::log(result, result);
  return result;
}

}  // namespace

LensDirt::LensDirt(const RigCamera& camera) : camera_(workingCamera(camera)) {
  cv::Mat valid;
  cv::erode(camera_.validMask(), valid, cv::Mat::ones(2 * kMargin_px + 1, 2 * kMargin_px + 1, CV_8U),
            cv::Point(-1, -1), 1, cv::BORDER_CONSTANT, cv::Scalar(0));
  const Eigen::Matrix3d vehicle_from_camera = camera.vehicle_from_camera->rotationMatrix();
  const auto lookUp = [&](const Eigen::Vector3d& ray_in_vehicle) {
    Eigen::Vector2d pixel;
    if (!camera_.model().project(vehicle_from_camera.transpose() * ray_in_vehicle, &pixel)) {
      return -1;
    }
    const cv::Point at(cvRound(pixel.x()), cvRound(pixel.y()));
    const bool is_valid = cv::Rect(cv::Point(), valid.size()).contains(at) && valid.at<uint8_t>(at) != 0;
    return is_valid ? at.y * valid.cols + at.x : -1;
  };
  for (int y = 0; y < valid.rows; ++y) {
    for (int x = 0; x < valid.cols; ++x) {
      Eigen::Vector3d ray;
      if (valid.at<uint8_t>(y, x) == 0 || !camera_.model().unproject(Eigen::Vector2d(x, y), &ray)) {
        continue;
      }
      const Eigen::Vector3d direction = vehicle_from_camera * ray.normalized();
      const auto turned = [&](double angle_rad) {
        return lookUp(Eigen::AngleAxisd(angle_rad, Eigen::Vector3d::UnitZ()) * direction);
      };
      const GroundPixel pixel{y * valid.cols + x, turned(kBeside_rad), turned(-kBeside_rad)};
      if (direction.z() < -kGroundFall && pixel.left >= 0 && pixel.right >= 0) {
        ground_.push_back(pixel);
      }
    }
  }
}

void LensDirt::add(const cv::Mat& pixels, const RigidTransform& odom_from_vehicle) {
  if (odom_from_last_ &&
      (odom_from_vehicle.translation() - odom_from_last_->translation()).norm() < kLeastStep_m) {
    return;
  }
  odom_from_last_ = odom_from_vehicle;
  const double turn = (yawOfRotation(odom_from_vehicle.rotation()) + M_PI) / (2.0 * M_PI);
  Direction& current = directions_[static_cast<size_t>(turn * kNumDirections) % kNumDirections];
  double share = 0.0;
  for (Direction& direction : directions_) {
    share += direction.path.moveTo(odom_from_vehicle, &direction == &current);
  }
  const cv::Mat image = logarithm(camera_.undistort(pixels));
  if (current.mean.empty()) {
    current.mean = image;
    current.variance = cv::Mat::zeros(image.size(), CV_32FC1);
  } else {
    const cv::Mat difference = image - current.mean;
    current.mean += share * difference;
    current.variance += share * (difference.mul(difference) - current.variance);
  }
}

/// 1 where a pixel is brighter than both beside it, -1 where it is darker, otherwise 0.
int LensDirt::spotOf(const Direction& direction, const GroundPixel& pixel) const {
  const auto* mean = direction.mean.ptr<float>();
  const auto* variance = direction.variance.ptr<float>();
  const float left = mean[pixel.here] - mean[pixel.left], right = mean[pixel.here] - mean[pixel.right];
  const float contrast = std::min(std::abs(left), std::abs(right));
  const auto num_images = static_cast<float>(std::max(1.0, direction.path.length_m() / kIndependent_m));
  const float noise =
      (variance[pixel.here] + 0.5F * (variance[pixel.left] + variance[pixel.right])) / num_images;
  if (left * right <= 0.0F || contrast < kContrast || contrast * contrast < kSigmas * kSigmas * noise) {
    return 0;
  }
  return left > 0.0F ? 1 : -1;
}

double LensDirt::part() const {
  std::vector<const Direction*> driven;
  double path_m = 0.0;
  for (const Direction& direction : directions_) {
    if (direction.path.length_m() >= kDirection_m) {
      driven.push_back(&direction);
      path_m += direction.path.length_m();
    }
  }
  if (driven.size() < 2 || ground_.empty()) {
    return 0.0;
  }
  size_t num_dirty = 0;
  for (const GroundPixel& pixel : ground_) {
    // Path on which the pixel is darker than those beside it, and brighter, and in how many directions.
    std::array<double, 2> seen_m{};
    std::array<int, 2> seen_in{};
    for (const Direction* direction : driven) {
      const int spot = spotOf(*direction, pixel);
      if (spot != 0) {
        seen_m[spot > 0 ? 1 : 0] += direction->path.length_m();
        ++seen_in[spot > 0 ? 1 : 0];
      }
    }
    for (size_t i = 0; i < seen_m.size(); ++i) {
      num_dirty += seen_in[i] >= 2 && seen_m[i] >= kSeen_m && seen_m[i] >= kAgree * path_m ? 1 : 0;
    }
  }
  return static_cast<double>(num_dirty) / static_cast<double>(ground_.size());
}

}  // namespace vcharge
