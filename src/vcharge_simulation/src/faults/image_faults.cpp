#include "vcharge_simulation/faults/image_faults.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Core>

#include "vcharge_simulation/rendering/noise.h"

namespace vcharge {

namespace {

constexpr double kFullWidth_px = 1280.0;
// Lengths are for images that are 1280 wide; light is relative to white in the sun.
constexpr double kSunLight = 25.0;      // light at the centre of the sun
constexpr double kSunRadius_px = 40.0;  // radius at which the light is half as strong
constexpr double kMaxBlobRadius_px = 45.0;
constexpr double kMaxBlobLight = 0.15;
constexpr double kBlobTransmission = 0.35;  // transmission at the centre of a blob
constexpr double kLineLight = 0.5;
constexpr double kLineHalfWidth_px = 2.5;
// Thinner lines would fall between the pixels of scaled-down images.
constexpr double kMinLineHalfWidth_px = 0.6;

template <class Function>
cv::Mat mapOfPixels(cv::Size size, Function&& value) {
  cv::Mat map(size, CV_32FC1);
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      map.at<float>(y, x) = static_cast<float>(value(Eigen::Vector2d(x, y)));
    }
  }
  return map;
}

cv::Mat sunLight(const SunGlareFault& fault, cv::Size size) {
  const Eigen::Vector2d sun(fault.x * size.width - 0.5, fault.y * size.height - 0.5);
  const double radius_px = kSunRadius_px * size.width / kFullWidth_px;
  return mapOfPixels(size, [&](const Eigen::Vector2d& pixel) {
    return kSunLight / (1.0 + (pixel - sun).squaredNorm() / (radius_px * radius_px));
  });
}

struct Blob {
  Eigen::Vector2d centre_px;
  double radius_px, light;

  // 1 at the centre with a soft edge, because dirt on the lens is far out of focus.
  double weight(const Eigen::Vector2d& pixel) const {
    const double squared = (pixel - centre_px).squaredNorm() / (radius_px * radius_px);
    return std::exp(-squared * squared);
  }
};

void makeDirt(const DirtyLensFault& fault, const ImageFaults::Camera& camera, cv::Mat* transmission,
              cv::Mat* light) {
  const cv::Size size = camera.size_px;
  const double scale = size.width / kFullWidth_px;
  Random random(static_cast<uint64_t>(fault.seed) * 1024U + static_cast<uint64_t>(camera.index));
  std::vector<Blob> blobs(static_cast<size_t>(fault.blobs));
  for (Blob& blob : blobs) {
    blob.centre_px.x() = random.uniform(0.0, size.width);
    blob.centre_px.y() = random.uniform(0.0, size.height);
    blob.radius_px = scale * kMaxBlobRadius_px * random.uniform(0.3, 1.0);
    blob.light = random.uniform(0.0, kMaxBlobLight);
  }
  const double left_y = size.height * random.uniform(0.2, 0.8);
  const double right_y = size.height * random.uniform(0.2, 0.8);
  const Eigen::Vector2d along = Eigen::Vector2d(size.width, right_y - left_y).normalized();
  const double half_width_px = std::max(kMinLineHalfWidth_px, scale * kLineHalfWidth_px);
  *transmission = mapOfPixels(size, [&](const Eigen::Vector2d& pixel) {
    double passed = 1.0;
    for (const Blob& blob : blobs) {
      passed *= 1.0 - (1.0 - kBlobTransmission) * blob.weight(pixel);
    }
    return passed;
  });
  *light = mapOfPixels(size, [&](const Eigen::Vector2d& pixel) {
    const double across = (along.x() * (pixel.y() - left_y) - along.y() * pixel.x()) / half_width_px;
    double sum = kLineLight * std::exp(-0.5 * across * across);
    for (const Blob& blob : blobs) {
      sum += blob.light * blob.weight(pixel);
    }
    return sum;
  });
}

}  // namespace

ImageFaults::ImageFaults(const FaultOptions& faults, const std::vector<Camera>& cameras,
                         const CameraResponse& response, Timestamp start, uint64_t seed)
    : faults_(faults),
      cameras_(cameras),
      response_(response),
      start_(start),
      seed_(seed),
      sun_light_(cameras.size()),
      dirt_transmission_(cameras.size()),
      dirt_light_(cameras.size()),
      last_image_(cameras.size()),
      hits_{std::vector<std::vector<Timestamp>>(cameras.size()),
            std::vector<std::vector<Timestamp>>(cameras.size())} {
  faults.validate();
  for (size_t i = 0; i < cameras.size(); ++i) {
    if (faults.sun_glare.actsOn(cameras[i].name)) {
      sun_light_[i] = sunLight(faults.sun_glare, cameras[i].size_px);
    }
    if (faults.dirty_lens.actsOn(cameras[i].name)) {
      makeDirt(faults.dirty_lens, cameras[i], &dirt_transmission_[i], &dirt_light_[i]);
    }
  }
}

cv::Mat ImageFaults::throughLens(size_t camera, Timestamp stamp, const cv::Mat& clean) const {
  const Camera& about = cameras_.at(camera);
  const bool sun = faults_.sun_glare.actsOn(about.name, sinceStart(stamp));
  const bool dirt = faults_.dirty_lens.actsOn(about.name, sinceStart(stamp));
  if (!sun && !dirt) {
    return clean;
  }
  cv::Mat light_of_gray(1, 256, CV_32FC1);
  for (int gray = 0; gray < 256; ++gray) {
    light_of_gray.at<float>(gray) = static_cast<float>(response_.lightFromGray(gray));
  }
  cv::Mat light;
  cv::LUT(clean, light_of_gray, light);
  if (dirt) {
    light = light.mul(dirt_transmission_[camera]) + dirt_light_[camera];
  }
  if (sun) {
    light += sun_light_[camera];
  }
  return response_.develop(light);
}

double ImageFaults::exposureGain(size_t camera, Timestamp stamp) const {
  const bool step = faults_.exposure_step.actsOn(cameras_.at(camera).name, sinceStart(stamp));
  return step ? faults_.exposure_step.gain : 1.0;
}

bool ImageFaults::hit(const DroppedImagesFault& fault, size_t camera, size_t frame, Timestamp stamp,
                      uint64_t kind) const {
  if (!fault.actsOn(cameras_[camera].name, sinceStart(stamp))) {
    return false;
  }
  const auto index = static_cast<uint64_t>(cameras_[camera].index);
  Random random(seed_ * 0x9E3779B97F4A7C15ULL + (frame * 64U + index) * 2U + kind);
  return random.chance(fault.probability);
}

std::optional<DeliveredImage> ImageFaults::deliver(size_t camera, size_t frame, Timestamp stamp,
                                                   const cv::Mat& image) {
  const std::string& name = cameras_.at(camera).name;
  const Duration since_start = sinceStart(stamp);
  cv::Mat& last = last_image_[camera];
  if (last.empty() || !faults_.frozen_camera.actsOn(name, since_start)) {
    last = image;
  }
  DeliveredImage delivered{stamp, stamp, last};
  if (faults_.dead_camera.actsOn(name, since_start)) {
    if (!faults_.dead_camera.black_images) {
      return std::nullopt;
    }
    delivered.pixels = cv::Mat::zeros(image.size(), image.type());
  }
  if (hit(faults_.dropped_images, camera, frame, stamp, 0)) {
    hits_.dropped[camera].push_back(stamp);
    return std::nullopt;
  }
  if (hit(faults_.late_images, camera, frame, stamp, 1)) {
    hits_.late[camera].push_back(stamp);
    delivered.received = stamp + durationFromSeconds(faults_.late_images.delay_s);
  }
  if (faults_.image_stamp_shift.actsOn(name, since_start)) {
    delivered.stamp = stamp + durationFromSeconds(faults_.image_stamp_shift.shift_s);
  }
  return delivered;
}

}  // namespace vcharge
