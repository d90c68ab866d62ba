#include "illumination/vehicle_light.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Core>
#include <opencv2/imgproc.hpp>

#include "vcharge_core/base/wide_loops.h"

namespace vcharge {
namespace {

constexpr double kFade_m = 3.0, kFade_rad = 0.15;
constexpr double kMinPath_m = 0.5;
// Added to gray levels before their logarithm, so that noise of dark pixels stays small.
constexpr float kDark = 2.0F;
constexpr double kMaxGround_m = 20.0;
// Side of the neighbourhood in which light is compared.
constexpr int kAround_px = 41;
// Motion of the ground after which a window shows other ground, and after which its mean is trusted: not at
// all, and fully.
constexpr double kIndependent_px = 10.0, kUntrusted_px = 50.0, kTrusted_px = 100.0;
// A contrast is light if its square is larger by this factor than the ground's own contrast leaves in the
// mean.
constexpr float kSignificance = 4.0F;

/// Updates mean and variance of `count` values, a new one having this share.
VCHARGE_WIDE_LOOPS void update(const float* value, float share, int count, float* mean, float* variance) {
  for (int i = 0; i < count; ++i) {
    const float difference = value[i] - mean[i];
    mean[i] += share * difference;
    variance[i] += share * (difference * difference - variance[i]);
  }
}

cv::Mat boxMean(const cv::Mat& image, int side) {
  cv::Mat mean;
  cv::blur(image, mean, {side, side});
  return mean;
}

}  // namespace

VehicleLight::VehicleLight(const MeiCamera& camera, const cv::Mat& valid_mask,
                           const RigidTransform& vehicle_from_camera)
    : ground_(cv::Mat::zeros(valid_mask.size(), CV_32FC1)),
      motion_px_per_m_(cv::Mat::zeros(valid_mask.size(), CV_32FC1)),
      path_(kFade_m, kFade_rad) {
  constexpr double kStep_m = 0.01;
  const Eigen::Matrix3d rotation = vehicle_from_camera.rotationMatrix();
  for (int y = 0; y < valid_mask.rows; ++y) {
    for (int x = 0; x < valid_mask.cols; ++x) {
      const Eigen::Vector2d pixel(x, y);
      Eigen::Vector3d ray;
      if (valid_mask.at<uint8_t>(y, x) == 0 || !camera.unproject(pixel, &ray)) {
        continue;
      }
      const double fall = -(rotation * ray).z();
      const Eigen::Vector3d point = ray * (vehicle_from_camera.translation().z() / fall);
      Eigen::Vector2d moved;
      if (fall > 0.0 && point.norm() < kMaxGround_m &&
          camera.project(point - kStep_m * rotation.row(0).transpose(), &moved)) {
        ground_.at<float>(y, x) = 1.0F;
        motion_px_per_m_.at<float>(y, x) = static_cast<float>((moved - pixel).norm() / kStep_m);
      }
    }
  }
  ground_around_ = boxMean(ground_, kAround_px);
}

void VehicleLight::clear() {
  mean_.release();
  path_.clear();
}

void VehicleLight::remember(const cv::Mat& log_image, double share) {
  if (mean_.empty()) {
    mean_ = log_image.clone();
    variance_ = cv::Mat::zeros(log_image.size(), CV_32FC1);
    return;
  }
  for (int y = 0; y < log_image.rows; ++y) {
    update(log_image.ptr<float>(y), static_cast<float>(share), log_image.cols, mean_.ptr<float>(y),
           variance_.ptr<float>(y));
  }
}

/// What the light adds to the logarithms (CV_32FC1).
cv::Mat VehicleLight::correction() const {
  cv::Mat light = boxMean(mean_.mul(ground_), kAround_px);
  for (int y = 0; y < light.rows; ++y) {
    const auto* mean = mean_.ptr<float>(y);
    const auto* around = ground_around_.ptr<float>(y);
    auto* row = light.ptr<float>(y);
    for (int x = 0; x < light.cols; ++x) {
      row[x] = around[x] > 0.05F ? mean[x] - row[x] / around[x] : 0.0F;
    }
  }
  const cv::Mat contrast = boxMean(light.mul(light), 7), texture = boxMean(variance_, 7);
  cv::Mat share(light.size(), CV_32FC1);
  const auto path_m = static_cast<float>(path_.length_m());
  constexpr auto kNoise_px = static_cast<float>(kSignificance * kIndependent_px);
  for (int y = 0; y < light.rows; ++y) {
    const auto* motion = motion_px_per_m_.ptr<float>(y);
    const auto* square = contrast.ptr<float>(y);
    const auto* variance = texture.ptr<float>(y);
    auto* row = share.ptr<float>(y);
    for (int x = 0; x < light.cols; ++x) {
      const float moved_px = motion[x] * path_m;
      const float signal = moved_px * square[x];
      row[x] = signal > kNoise_px * variance[x] ? 1.0F - kNoise_px * variance[x] / signal : 0.0F;
    }
  }
  share = boxMean(share, 5);
  for (int y = 0; y < light.rows; ++y) {
    const auto* motion = motion_px_per_m_.ptr<float>(y);
    const auto* part = share.ptr<float>(y);
    auto* row = light.ptr<float>(y);
    for (int x = 0; x < light.cols; ++x) {
      constexpr auto kFrom_px = static_cast<float>(kUntrusted_px);
      constexpr auto kPer_px = static_cast<float>(1.0 / (kTrusted_px - kUntrusted_px));
      row[x] *= part[x] * std::min(std::max((motion[x] * path_m - kFrom_px) * kPer_px, 0.0F), 1.0F);
    }
  }
  return light;
}

cv::Mat VehicleLight::removeFrom(const cv::Mat& image, const RigidTransform& world_from_camera) {
  static const cv::Mat logarithms = [] {
    cv::Mat table(1, 256, CV_32FC1);
    for (int gray = 0; gray < 256; ++gray) {
      table.at<float>(gray) = std::log(static_cast<float>(gray) + kDark);
    }
    return table;
  }();
  cv::Mat log_image;
  cv::LUT(image, logarithms, log_image);
  remember(log_image, path_.moveTo(world_from_camera));
  if (path_.length_m() < kMinPath_m) {
    return image;
  }
  const cv::Mat light = correction();
  cv::Mat result = image.clone();
  for (int y = 0; y < image.rows; ++y) {
    const auto* row = light.ptr<float>(y);
    auto* gray = result.ptr<uint8_t>(y);
    for (int x = 0; x < image.cols; ++x) {
      if (row[x] != 0.0F) {
        gray[x] =
            cv::saturate_cast<uint8_t>((static_cast<float>(gray[x]) + kDark) * std::exp(-row[x]) - kDark);
      }
    }
  }
  return result;
}

}  // namespace vcharge
