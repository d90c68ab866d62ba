#include "contacts/ground_contact.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <opencv2/imgproc.hpp>

#include "ground/image_windows.h"
#include "vcharge_core/base/quantile.h"

namespace vcharge {
namespace {

constexpr int kNumSectors = 360;
constexpr double kMinRange_m = 0.4;
// Rays that fall less reach the ground beyond any range of interest.
constexpr double kLeastSlope = 1e-3;
// Half the side of the windows that are compared, and the side of those that smooth.
constexpr int kHalfWindow_px = 2, kSmoothing_px = 3;
// Standard deviation in gray levels from which a window has texture, and the correlations above and below
// which it shows the ground or something else.
constexpr float kTexture = 2.5F, kSame = 0.7F, kOther = 0.5F;
// Windows without texture show the ground if their brightness differs by less than this, absolute and
// relative.
constexpr float kSameBrightness = 6.0F, kSameBrightnessRatio = 0.06F;
// Pixels darker than this do not tell the exposure.
constexpr uint8_t kMinBrightness = 8;
// Inverse ranges, relative to that of the ground, at which reflections are searched: trees and clouds are far
// away, and cars about as far behind the ground as before it.
constexpr float kMirrorDepths[] = {0.0F, 0.33F, 0.67F};
// Number of bins below a contact that must show ground, and their least mean label.
constexpr int kGroundBins = 10;
constexpr double kMinGround = 0.4;
// The windows that a contact lies in do not show the ground either: it seems lower by about this.
constexpr double kReach_px = 1.2;
// Error of a contact's position in the image, as measured on simulated people (feet swing, shadows move
// along), and of the direction of the ground (pitch of the body).
constexpr double kContactSigma_px = 3.0, kPitchSigma_rad = 0.003;

}  // namespace

GroundContact::GroundContact(const WorkingCamera& camera, const RigidTransform& vehicle_from_camera,
                             double max_range_m)
    : camera_(camera),
      vehicle_from_camera_(vehicle_from_camera),
      height_m_(vehicle_from_camera.translation().z()),
      min_inverse_per_m_(1.0 / max_range_m),
      warp_(camera.model(), camera.validMask()) {
  const double focal_px = camera.model().gamma1() / (1.0 + camera.model().xi());
  bin_per_m_ = 1.0 / (focal_px * height_m_);
  num_bins_ = static_cast<int>((1.0 / kMinRange_m - min_inverse_per_m_) / bin_per_m_);
  pixels_.assign(static_cast<size_t>(kNumSectors) * num_bins_, -1);
  const RigidTransform camera_from_vehicle = vehicle_from_camera.inverse();
  int top = camera.size().height, bottom = 0;
  for (int sector = 0; sector < kNumSectors; ++sector) {
    const double azimuth_rad = (sector + 0.5) * 2.0 * M_PI / kNumSectors - M_PI;
    for (int bin = 0; bin < num_bins_; ++bin) {
      const double range_m = 1.0 / (min_inverse_per_m_ + (bin + 0.5) * bin_per_m_);
      const Eigen::Vector3d ground(vehicle_from_camera.translation().x() + range_m * std::cos(azimuth_rad),
                                   vehicle_from_camera.translation().y() + range_m * std::sin(azimuth_rad),
                                   0.0);
      Eigen::Vector2d pixel;
      if (!camera.model().project(camera_from_vehicle * ground, &pixel)) {
        continue;
      }
      const cv::Point at(cvRound(pixel.x()), cvRound(pixel.y()));
      if (cv::Rect(cv::Point(), camera.size()).contains(at) && camera.validMask().at<uint8_t>(at) != 0) {
        pixels_[static_cast<size_t>(sector) * num_bins_ + bin] = at.y * camera.size().width + at.x;
        top = std::min(top, at.y);
        bottom = std::max(bottom, at.y + 1);
      }
    }
  }
  rows_ = top < bottom ? cv::Rect(0, top, camera.size().width, bottom - top) : cv::Rect();
  for (int y = rows_.y; y < rows_.y + rows_.height; ++y) {
    for (int x = 0; x < rows_.width; ++x) {
      Eigen::Vector3d ray;
      if (camera.validMask().at<uint8_t>(y, x) != 0 &&
          camera.model().unproject({static_cast<double>(x), static_cast<double>(y)}, &ray)) {
        const Eigen::Vector3d direction = vehicle_from_camera.rotation() * ray.normalized();
        if (direction.z() < -kLeastSlope) {
          const Eigen::Vector3f axis = direction.cast<float>();
          ground_.add(y * rows_.width + x, axis.x(), axis.y(), axis.z(),
                      static_cast<float>(-direction.z() / height_m_));
        }
      }
    }
  }
}

int GroundContact::sectorOf(double azimuth_rad) const {
  const int sector = static_cast<int>(std::floor((azimuth_rad + M_PI) / (2.0 * M_PI) * kNumSectors));
  return (sector % kNumSectors + kNumSectors) % kNumSectors;
}

void GroundContact::compare(const cv::Mat& now, const cv::Mat& before, const RigidTransform& before_from_now,
                            bool is_mirror) {
  labels_ = cv::Mat::zeros(now.size(), CV_8SC1);
  if (rows_.empty()) {
    return;
  }
  cv::Mat smooth;
  // Fine grain does not look alike from another distance.
  cv::blur(now(rows_), smooth, cv::Size(kSmoothing_px, kSmoothing_px));
  const RigidTransform camera_from_now = vehicle_from_camera_.inverse() * before_from_now;
  // Points deeper than the ground have a part of its inverse range.
  const auto compareAt = [&](float inverse_range_part, cv::Mat* labels) {
    labelGround(smooth,
                warp_.warp(before, camera_from_now, vehicle_from_camera_.translation(), ground_,
                           inverse_range_part, rows_),
                labels);
  };
  compareAt(1.0F, &labels_);
  if (!is_mirror) {
    return;
  }
  // What is static and deeper than the ground is a reflection: the ground is visible there too.
  for (const float part : kMirrorDepths) {
    cv::Mat labels = cv::Mat::zeros(now.size(), CV_8SC1);
    compareAt(part, &labels);
    labels_.setTo(cv::Scalar(1), labels == 1);
    labels_.setTo(cv::Scalar(0), (labels == 0) & (labels_ == -1));
  }
}

void GroundContact::labelGround(const cv::Mat& now, const WarpedImage& before, cv::Mat* labels) const {
  cv::Mat is_known, smooth;
  cv::erode(before.known, is_known, cv::Mat::ones(2 * kHalfWindow_px + 1, 2 * kHalfWindow_px + 1, CV_8U));
  cv::blur(before.image, smooth, cv::Size(kSmoothing_px, kSmoothing_px));
  // Most of the ground is unchanged, so the median ratio is the change of the exposure.
  std::vector<double> ratios;
  for (int y = 0; y < rows_.height; y += 4) {
    for (int x = 0; x < rows_.width; x += 4) {
      if (is_known.at<uint8_t>(y, x) != 0 && smooth.at<uint8_t>(y, x) > kMinBrightness) {
        ratios.push_back(static_cast<float>(now.at<uint8_t>(y, x)) /
                         static_cast<float>(smooth.at<uint8_t>(y, x)));
      }
    }
  }
  const float gain = ratios.empty() ? 1.0F : static_cast<float>(quantile(std::move(ratios), 0.5));
  ImageWindows windows(now, {smooth}, kHalfWindow_px);
  for (int y = 0; y < rows_.height; ++y) {
    windows.nextRow();
    const auto* known = is_known.ptr<uint8_t>(y);
    auto* label = labels->ptr<int8_t>(y + rows_.y);
    const float* mean = windows.mean();
    const float* mean_before = windows.meanBefore(0);
    const float* variance = windows.variance();
    const float* variance_before = windows.varianceBefore(0);
    const float* correlation = windows.correlation(0);
    for (int x = 0; x < rows_.width; ++x) {
      if (known[x] == 0) {
        continue;
      }
      if (std::max(variance[x], variance_before[x]) < kTexture * kTexture) {
        const float difference = std::abs(mean[x] - gain * mean_before[x]);
        label[x] = difference < kSameBrightness + kSameBrightnessRatio * mean[x] ? 1 : -1;
      } else if (correlation[x] > kSame) {
        label[x] = 1;
      } else if (correlation[x] < kOther) {
        label[x] = -1;
      }
    }
  }
}

int GroundContact::labelAt(int sector, int bin) const {
  const int32_t pixel = pixels_[static_cast<size_t>((sector + kNumSectors) % kNumSectors) * num_bins_ + bin];
  return pixel < 0 ? 0 : labels_.ptr<int8_t>()[pixel];
}

std::optional<Contact> GroundContact::below(const Eigen::Vector3d& ray_in_vehicle) const {
  const int sector = sectorOf(std::atan2(ray_in_vehicle.y(), ray_in_vehicle.x()));
  return belowSectors(sector - 1, 3, ray_in_vehicle.z() / ray_in_vehicle.head<2>().norm());
}

std::optional<Contact> GroundContact::below(double low_rad, double high_rad, double slope) const {
  const int low = sectorOf(low_rad), high = sectorOf(high_rad);
  return belowSectors(low, (high - low + kNumSectors) % kNumSectors + 1, slope);
}

std::optional<Contact> GroundContact::belowSectors(int first_sector, int num_sectors, double slope) const {
  if (labels_.empty()) {
    return std::nullopt;
  }
  int first = 0;
  if (slope < 0.0) {
    const double bin = (-slope / height_m_ - min_inverse_per_m_) / bin_per_m_;
    first = std::clamp(static_cast<int>(bin), 0, num_bins_ - 1);
  }
  std::vector<int> scores;
  for (int bin = first; bin < num_bins_; ++bin) {
    int sum = 0;
    for (int sector = first_sector; sector < first_sector + num_sectors; ++sector) {
      sum += labelAt(sector, bin);
    }
    scores.push_back(sum);
  }
  // A contact before bin c: what lies from the ray down to it is not ground, and the bins below it are.
  const int count = static_cast<int>(scores.size());
  int above = 0, ground = 0, best = -1, best_score = 0, best_ground = 0;
  for (int i = 0; i < std::min(kGroundBins, count); ++i) {
    ground += scores[static_cast<size_t>(i)];
  }
  for (int c = 0; c + kGroundBins <= count; ++c) {
    if (c == 0 || ground - above > best_score) {
      best = c;
      best_score = ground - above;
      best_ground = ground;
    }
    above += scores[static_cast<size_t>(c)];
    ground -= scores[static_cast<size_t>(c)];
    ground += c + kGroundBins < count ? scores[static_cast<size_t>(c + kGroundBins)] : 0;
  }
  if (best < 0 || best_ground < kMinGround * num_sectors * kGroundBins) {
    return std::nullopt;
  }
  const double inverse_per_m =
      std::max(0.5 * min_inverse_per_m_, min_inverse_per_m_ + (first + best - kReach_px) * bin_per_m_);
  const double sigma_per_m = std::hypot(kContactSigma_px * bin_per_m_, kPitchSigma_rad / height_m_);
  return Contact{1.0 / inverse_per_m, sigma_per_m / (inverse_per_m * inverse_per_m)};
}

}  // namespace vcharge
