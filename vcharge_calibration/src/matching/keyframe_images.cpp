#include "vcharge_calibration/matching/keyframe_images.h"

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

namespace vcharge {

void KeyframeImages::add(int32_t keyframe, const std::vector<Image>& images) {
  if (keyframe % step_ != 0) {
    return;
  }
  std::vector<Jpeg>& jpegs = jpegs_[keyframe];
  for (const Image& image : images) {
    jpegs.emplace_back();
    if (image.pixels.empty()) {
      continue;
    }
    cv::Mat small = image.pixels;
    if (small.cols > max_width_px_) {
      const double scale = static_cast<double>(max_width_px_) / small.cols;
      cv::resize(image.pixels, small, cv::Size(), scale, scale, cv::INTER_AREA);
    }
    auto bytes = std::make_shared<std::vector<uint8_t>>();
    cv::imencode(".jpg", small, *bytes, {cv::IMWRITE_JPEG_QUALITY, quality_});
    jpegs.back() = bytes;
  }
  if (jpegs_.size() > max_keyframes_) {
    step_ *= 2;
    for (auto entry = jpegs_.begin(); entry != jpegs_.end();) {
      entry = entry->first % step_ == 0 ? std::next(entry) : jpegs_.erase(entry);
    }
  }
}

std::vector<int32_t> KeyframeImages::keyframes() const {
  std::vector<int32_t> result;
  for (const auto& [keyframe, jpegs] : jpegs_) {
    result.push_back(keyframe);
  }
  return result;
}

cv::Mat KeyframeImages::image(int32_t keyframe, size_t camera) const {
  const auto found = jpegs_.find(keyframe);
  if (found == jpegs_.end() || camera >= found->second.size() || !found->second[camera]) {
    return cv::Mat();
  }
  return cv::imdecode(*found->second[camera], cv::IMREAD_GRAYSCALE);
}

}  // namespace vcharge
