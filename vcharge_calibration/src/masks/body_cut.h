#pragma once

#include "masks/static_structure.h"

namespace vcharge::internal {

/// Division of the field of view, of the SmallView's size.
struct BodyRegions {
  cv::Mat body;   ///< CV_8UC1, 255 where the body is seen
  cv::Mat spots;  ///< CV_8UC1, 255 on other static edges: of dirt and drops on the lens
};

/// Separates the body from the scene by a minimum cut (Boykov and Kolmogorov, PAMI 2004): static edges are
/// evidence of the body and make a cut along them cheap, moving structure is evidence of the scene.
BodyRegions cutBody(const SmallView& view, const StaticStructure& structure);

}  // namespace vcharge::internal
