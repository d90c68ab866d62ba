#pragma once

#include <cstdint>

#include <opencv2/core.hpp>

namespace vcharge {

/// What surfaces show: factors, and the relief of the ground.
struct SurfaceVariety {
  double grain = 1.0;             ///< contrast of the grain of the ground
  double grain_size = 1.0;        ///< its size
  bool has_coarse_grain = false;  ///< a second grain, of some centimetres, as of paving that settled
  double relief_m = 0.0;          ///< see GroundLayers
  double pattern = 1.0;  ///< contrast of cracks, stains, paint, signs and windows with their surroundings
  double leaf = 1.0;     ///< length of leaves; their number keeps the foliage as dense
  double foliage = 1.0;  ///< density of foliage; the sky shows through where it is low

  /// Draws outdoor surfaces, or those of a building with its smooth floors; seed 0 gives the values above.
  static SurfaceVariety outdoors(uint64_t seed);
  static SurfaceVariety indoors(uint64_t seed);

  /// Draws a texture (CV_8UC1) towards its mean over about a metre, as dust and wear do.
  void fade(double texels_per_m, cv::Mat* texture) const;
};

}  // namespace vcharge
