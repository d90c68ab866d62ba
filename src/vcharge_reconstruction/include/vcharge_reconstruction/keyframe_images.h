#pragma once

#include <climits>
#include <cstdint>
#include <map>
#include <memory>
#include <vector>

#include <opencv2/core.hpp>

#include "vcharge_core/frames/image.h"

namespace vcharge {

/// Images of keyframes as JPEGs: by default a few small ones, evenly distributed over the drive. Copies share
/// the images.
class KeyframeImages {
 public:
  static constexpr size_t kMaxKeyframes = 64;
  static constexpr int kMaxWidth_px = 640;
  static constexpr int kQuality = 80;

  explicit KeyframeImages(size_t max_keyframes = kMaxKeyframes, int max_width_px = kMaxWidth_px,
                          int quality = kQuality)
      : max_keyframes_(max_keyframes), max_width_px_(max_width_px), quality_(quality) {}
  /// Keeps the images of all keyframes, in full size and high quality.
  static KeyframeImages ofAllKeyframes() { return KeyframeImages(SIZE_MAX, INT_MAX, 95); }

  /// Adds the images of a keyframe, in the rig's order (empty if missing), unless this part of the drive
  /// already has enough. Keyframes must be added in order.
  void add(int32_t keyframe, const std::vector<Image>& images);

  /// Indices of the keyframes with images, in order.
  std::vector<int32_t> keyframes() const;

  /// CV_8UC1, at most as wide as given to the constructor; empty if missing.
  cv::Mat image(int32_t keyframe, size_t camera) const;

 private:
  using Jpeg = std::shared_ptr<const std::vector<uint8_t>>;
  size_t max_keyframes_;
  int max_width_px_, quality_;
  std::map<int32_t, std::vector<Jpeg>> jpegs_;  // a null pointer: no image
  int32_t step_ = 1;                            // distance of kept keyframes, in keyframes
};

/// Converts a pixel coordinate to a smaller copy of the image; pixel centres have integer coordinates.
inline double toSmallImage(double position_px, double small_per_full) {
  return (position_px + 0.5) * small_per_full - 0.5;
}

}  // namespace vcharge
