#pragma once

#include <cstdint>

#include <opencv2/core.hpp>

#include "scenes/garage/garage_layout.h"

namespace vcharge {

/// What years of use leave on a garage's floor: oil that dripped from engines, drops, chewing gum, grit,
/// rubber of tyres that turned into the bays, lime around dried puddles, patches of mortar, litter. CV_32FC1:
/// the floor's reflectance over that of the clean one; row 0 is at min_y of kGarageArea.
cv::Mat drawGarageStains(const GarageLayout& layout, double texel_m, uint64_t seed);

}  // namespace vcharge
