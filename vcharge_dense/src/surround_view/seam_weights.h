#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include "surround_view/ground_projection.h"

namespace vcharge {

/// No camera.
inline constexpr uint8_t kNoCamera = std::numeric_limits<uint8_t>::max();

/// A pixel of the view in one camera.
struct ViewSample {
  PyramidPosition position;
  uint8_t camera = kNoCamera;
  uint8_t weight = 0;  ///< its part of the pixel if both cameras have images, in 255ths
  uint8_t angle = 0;   ///< between the optical axis and the ray, see kAngleSteps
};

/// The two cameras that see each pixel of a view best, in row-major order; the weights of a pixel add up to
/// 255.
struct ViewLayers {
  std::vector<ViewSample> first, second;  ///< the first one has the larger weight
  /// Standard deviation of the second camera over that of the first; 0 without a second one.
  std::vector<float> sigma_ratio;
};

/// Chooses and weights cameras: the one with the smallest standard deviation shows a pixel. At the seams,
/// over half a metre, and at the rim of what a camera sees, one goes over into the other. `projections`: one
/// per camera of the rig; those without positions are left out.
ViewLayers weightCameras(const ViewGrid& grid, const std::vector<GroundProjection>& projections);

}  // namespace vcharge
