#pragma once

#include <cstdint>

#include <opencv2/core.hpp>

namespace vcharge {

/// What the surroundings of a pixel show.
struct PlaneFit {
  enum : uint8_t {
    kUndecided,
    kGround,  ///< fits the ground, and fits the plane above it worse
    kOther,   ///< fits the plane above better, or neither
  };
  /// Side of the windows that are correlated.
  static constexpr int kWindow_px = 5;
};

/// Compares an image (CV_8UC1) with an older one that was warped as if it showed the ground, and as if it
/// showed a plane above the ground; `knows_raised` (CV_8UC1) is 0 where the latter is unknown. All have one
/// size. Returns CV_8UC1 with values of PlaneFit, and in `keeps_texture` the result of keepsTexture();
/// windows at the border are cut off there.
cv::Mat fitPlanes(const cv::Mat& now, const cv::Mat& on_ground, const cv::Mat& on_raised,
                  const cv::Mat& knows_raised, cv::Mat* keeps_texture);

/// Where the ground around a pixel has texture that the newer image shows too, if only roughly and in
/// whatever light; images as above. Returns CV_8UC1, 255 where it does and 0 elsewhere.
cv::Mat keepsTexture(const cv::Mat& now, const cv::Mat& on_ground);

}  // namespace vcharge
