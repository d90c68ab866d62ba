#include "vcharge_localization/camera_health.h"

#include <cmath>
#include <cstring>
#include <sstream>
#include <utility>

#include "vcharge_core/base/error.h"

namespace vcharge {
namespace {

constexpr int kSampleStep_px = 16;
constexpr double kMinMotion_m = 0.01;
constexpr double kMemory_frames = 12.0;  // time constant of the averages; equals one second
// Ratio of a camera's fraction of features that fit the map to that of the others. A smaller ratio means that
// the camera looks in another direction than its extrinsics say.
constexpr double kMinFound = 0.1;

/// Samples pixels on a coarse grid. Noise makes the samples of two different images differ.
cv::Mat sampleOf(const cv::Mat& image) {
  cv::Mat sample(image.rows / kSampleStep_px + 1, image.cols / kSampleStep_px + 1, CV_8UC1, cv::Scalar(0));
  for (int y = 0; y * kSampleStep_px < image.rows; ++y) {
    for (int x = 0; x * kSampleStep_px < image.cols; ++x) {
      sample.at<uchar>(y, x) = image.at<uchar>(y * kSampleStep_px, x * kSampleStep_px);
    }
  }
  return sample;
}

bool isEqual(const cv::Mat& a, const cv::Mat& b) {
  return a.size() == b.size() && !a.empty() && std::memcmp(a.data, b.data, a.total()) == 0;
}

}  // namespace

CameraHealth::CameraHealth(std::shared_ptr<const CameraRig> rig, const CameraHealthOptions& options)
    : rig_(std::move(rig)), options_(options), cameras_(rig_->cameras.size()) {
  options_.validate();
}

void CameraHealth::setCondition(const RigCondition& condition) {
  check(condition.size() == cameras_.size(), "CameraHealth::setCondition: expected one entry per camera");
  for (size_t i = 0; i < cameras_.size(); ++i) {
    cameras_[i].has_moved = condition[i].has_moved;
  }
}

RigFeatures CameraHealth::usableFeatures(RigFeatures features) const {
  for (size_t i = 0; i < cameras_.size(); ++i) {
    if (cameras_[i].has_moved) {
      features.images[i] = ImageFeatures();
      features.rays_in_camera[i].resize(3, 0);
    }
  }
  return features;
}

std::vector<Image> CameraHealth::usableImages(const ImageFrame& frame) {
  const bool moves =
      frame.odom_from_vehicle && last_odom_from_vehicle_ &&
      (frame.odom_from_vehicle->translation() - last_odom_from_vehicle_->translation()).norm() > kMinMotion_m;
  last_odom_from_vehicle_ = frame.odom_from_vehicle;
  std::vector<Image> images = frame.images;
  for (size_t i = 0; i < images.size(); ++i) {
    Camera& camera = cameras_[i];
    camera.is_missing = images[i].pixels.empty();
    if (camera.is_missing) {
      continue;
    }
    cv::Mat sample = sampleOf(images[i].pixels);
    if (!isEqual(sample, camera.sample)) {
      camera.equal_images = 0;
    } else if (moves) {
      ++camera.equal_images;
    }
    camera.sample = std::move(sample);
    if (camera.has_moved || camera.equal_images >= options_.frozen_after_frames) {
      images[i] = Image();
    }
  }
  return images;
}

void CameraHealth::average(double value, double* mean) const {
  *mean += (value - *mean) / kMemory_frames;
}

void CameraHealth::addFeatures(const RigFeatures& features) {
  for (size_t i = 0; i < cameras_.size(); ++i) {
    ++cameras_[i].frames;
    average(static_cast<double>(features.images[i].size()), &cameras_[i].features);
  }
}

void CameraHealth::addFix(const PoseFix& fix) {
  for (size_t i = 0; i < cameras_.size(); ++i) {
    ++cameras_[i].fixes;
    average(fix.matches_of_camera[i], &cameras_[i].matches);
    average(fix.inliers_of_camera[i], &cameras_[i].inliers);
  }
}

std::string CameraHealth::contradictionOf(size_t index) const {
  const Camera& camera = cameras_[index];
  if (camera.fixes < kMemory_frames) {
    return "";
  }
  Camera others;
  for (size_t i = 0; i < cameras_.size(); ++i) {
    if (i != index) {
      others.features += cameras_[i].features;
      others.matches += cameras_[i].matches;
      others.inliers += cameras_[i].inliers;
    }
  }
  std::ostringstream text;
  if (camera.inliers * others.features < kMinFound * camera.features * others.inliers) {
    text << "hardly any of its features (" << std::lround(camera.inliers) << " of "
         << std::lround(camera.features) << ") fit the map: bumped, wrong intrinsics, or an unmapped side?";
  } else if (camera.inliers * others.matches < options_.min_agreement * camera.matches * others.inliers) {
    text << "only " << std::lround(100.0 * camera.inliers / camera.matches)
         << " % of its matches fit the pose, " << std::lround(100.0 * others.inliers / others.matches)
         << " % of the other cameras': bumped, or wrong intrinsics?";
  }
  return text.str();
}

std::vector<std::string> CameraHealth::warnings() const {
  std::vector<std::string> warnings;
  for (size_t i = 0; i < cameras_.size(); ++i) {
    const Camera& camera = cameras_[i];
    const std::string& name = rig_->cameras[i].name;
    const std::string contradiction = contradictionOf(i);
    std::ostringstream text;
    if (camera.has_moved) {
      text << name << ": left out, since it moved; its extrinsics must be repaired";
    } else if (camera.is_missing) {
      text << name << ": no image";
    } else if (camera.equal_images >= options_.frozen_after_frames) {
      text << name << ": frozen, it repeats one image";
    } else if (camera.frames >= kMemory_frames && camera.features < options_.min_features) {
      text << name << ": few features (" << std::lround(camera.features) << "): dark, blinded or covered?";
    } else if (!contradiction.empty()) {
      text << name << ": " << contradiction;
    } else {
      continue;
    }
    warnings.push_back(text.str());
  }
  return warnings;
}

}  // namespace vcharge
