#pragma once

#include <cstdint>

#include <opencv2/core.hpp>

namespace vcharge {

/// Factors on the contrast and size of what surfaces show.
struct SurfaceVariety {
  double grain = 1.0;    ///< contrast of the fine relief of the ground
  double pattern = 1.0;  ///< contrast of cracks, stains, paint, signs and windows with their surroundings
  double leaf = 1.0;     ///< length of leaves; their number keeps the foliage as dense

  /// Draws the factors; seed 0 gives 1 for all of them.
  static SurfaceVariety fromSeed(uint64_t seed);

  /// Draws a texture (CV_8UC1) towards its mean over about a metre, as dust and wear do.
  void fade(double texels_per_m, cv::Mat* texture) const;
};

}  // namespace vcharge
