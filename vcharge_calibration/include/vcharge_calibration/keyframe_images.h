#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <vector>

#include <opencv2/core.hpp>

#include "vcharge_core/image.h"

namespace vcharge {

/// A few keyframes' images of a drive, for pictures: small JPEGs, evenly spread over the drive however long
/// it becomes. Copies share the images.
class KeyframeImages {
 public:
  static constexpr size_t kMaxKeyframes = 64;
  static constexpr int kMaxWidth_px = 640;

  /// Takes the images of a keyframe, in the rig's order (empty where a camera sent none), or does not, where
  /// it has enough of that part of the drive. Keyframes come in order.
  void add(int32_t keyframe, const std::vector<Image>& images);

  /// In order.
  std::vector<int32_t> keyframes() const;

  /// CV_8UC1, at most kMaxWidth_px wide; empty where there is none.
  cv::Mat image(int32_t keyframe, size_t camera) const;

 private:
  using Jpeg = std::shared_ptr<const std::vector<uint8_t>>;
  std::map<int32_t, std::vector<Jpeg>> jpegs_;  // null: no image
  int32_t step_ = 1;                            // in keyframes
};

/// Pixel coordinates of a full image in one that was made smaller: centres are at whole coordinates.
inline double toSmallImage(double position_px, double small_per_full) {
  return (position_px + 0.5) * small_per_full - 0.5;
}

}  // namespace vcharge
