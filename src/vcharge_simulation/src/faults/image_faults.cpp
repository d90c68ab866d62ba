#include "vcharge_simulation/faults/image_faults.h"

#include <algorithm>

#include "vcharge_simulation/rendering/noise.h"

namespace vcharge {

ImageFaults::ImageFaults(const FaultOptions& faults, const std::vector<Camera>& cameras, Timestamp start,
                         uint64_t seed)
    : faults_(faults),
      cameras_(cameras),
      start_(start),
      seed_(seed),
      last_image_(cameras.size()),
      hits_{std::vector<std::vector<Timestamp>>(cameras.size()),
            std::vector<std::vector<Timestamp>>(cameras.size())} {
  faults.validate();
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
  delivered.stamp = stamp + durationFromSeconds(faults_.image_stamp_shift.shiftOf(name, since_start));
  if (faults_.image_stamp_shift.moves_exposure) {
    delivered.received = std::max(delivered.received, delivered.stamp);
  }
  return delivered;
}

}  // namespace vcharge
