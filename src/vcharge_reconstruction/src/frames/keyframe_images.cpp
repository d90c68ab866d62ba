#include "vcharge_reconstruction/keyframe_images.h"

#include <tbb/parallel_for.h>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

namespace vcharge {

void KeyframeImages::add(int32_t keyframe, const std::vector<Image>& images) {
  if (keyframe % step_ != 0) {
    return;
  }
  std::vector<Jpeg>& jpegs = jpegs_[keyframe];
  jpegs.resize(images.size());
  tbb::parallel_for(size_t{0}, images.size(), [&](size_t i) {
    cv::Mat small = images[i].pixels;
    if (small.empty()) {
      return;
    }
    if (small.cols > max_width_px_) {
      const double scale = static_cast<double>(max_width_px_) / small.cols;
      cv::resize(images[i].pixels, small, cv::Size(), scale, scale, cv::INTER_AREA);
    }
    auto bytes = std::make_shared<std::vector<uint8_t>>();
    cv::imencode(".jpg", small, *bytes, {cv::IMWRITE_JPEG_QUALITY, quality_});
    jpegs[i] = bytes;
  });
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
