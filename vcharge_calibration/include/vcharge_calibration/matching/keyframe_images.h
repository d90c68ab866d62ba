#pragma once

#include <climits>
#include <cstdint>
#include <map>
#include <memory>
#include <vector>

#include <opencv2/core.hpp>

#include "vcharge_core/frames/image.h"

namespace vcharge {

/// Keyframes' images of a drive as JPEGs: by default a few small ones for pictures, evenly spread over the
/// drive however long it becomes. Copies share the images.
class KeyframeImages {
 public:
  static constexpr size_t kMaxKeyframes = 64;
  static constexpr int kMaxWidth_px = 640;
  static constexpr int kQuality = 80;

  explicit KeyframeImages(size_t max_keyframes = kMaxKeyframes, int max_width_px = kMaxWidth_px,
                          int quality = kQuality)
      : max_keyframes_(max_keyframes), max_width_px_(max_width_px), quality_(quality) {}
  /// All of them, of full size, and so that hardly anything is lost.
  static KeyframeImages ofAllKeyframes() { return KeyframeImages(SIZE_MAX, INT_MAX, 95); }

  /// Takes the images of a keyframe, in the rig's order (empty where a camera sent none), or does not, where
  /// it has enough of that part of the drive. Keyframes come in order.
  void add(int32_t keyframe, const std::vector<Image>& images);

  /// In order.
  std::vector<int32_t> keyframes() const;

  /// CV_8UC1, at most as wide as was said; empty where there is none.
  cv::Mat image(int32_t keyframe, size_t camera) const;

 private:
  using Jpeg = std::shared_ptr<const std::vector<uint8_t>>;
  size_t max_keyframes_;
  int max_width_px_, quality_;
  std::map<int32_t, std::vector<Jpeg>> jpegs_;  // null: no image
  int32_t step_ = 1;                            // in keyframes
};

/// Pixel coordinates of a full image in one that was made smaller: centres are at whole coordinates.
inline double toSmallImage(double position_px, double small_per_full) {
  return (position_px + 0.5) * small_per_full - 0.5;
}

}  // namespace vcharge
