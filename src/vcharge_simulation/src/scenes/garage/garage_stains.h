#pragma once

#include <cstdint>

#include <opencv2/core.hpp>

#include "scenes/garage/garage_layout.h"

namespace vcharge {

/// Draws wear on the garage floor: oil, drops, chewing gum, grit, tyre marks, lime around dried puddles,
/// mortar patches and litter. Returns CV_32FC1, a factor on the reflectance of the clean floor; row 0 is at
/// min_y of kGarageArea.
cv::Mat drawGarageStains(const GarageLayout& layout, double texel_m, uint64_t seed);

}  // namespace vcharge
