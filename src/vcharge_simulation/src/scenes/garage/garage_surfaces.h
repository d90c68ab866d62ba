#pragma once

#include <cstdint>
#include <string>

#include <opencv2/core.hpp>

#include "scenes/garage/garage_layout.h"

namespace vcharge {

/// Texels per metre of the images of walls and pillars.
inline constexpr double kGarageTexelsPerM = 64.0;

/// Reflectance over kGroundLayerAlbedo of the garage's floor (CV_8UC1, row 0 at min_y): painted concrete with
/// joints, tyre marks, oil, cracks and markings.
cv::Mat drawGarageFloor(const GarageLayout& layout, double texel_m, uint64_t seed);
/// Reflectance of a concrete wall with a painted band, signs, doors, stains and cast joints.
cv::Mat drawGarageWall(double width_m, double height_m, uint32_t seed);
/// The four faces of a pillar side by side, with its name, a warning stripe and scratches.
cv::Mat drawGaragePillar(const std::string& name, uint32_t seed);
/// Bare concrete as it came from its form; a part of a ceiling.
cv::Mat drawFormedConcrete(int width_px, int height_px, double mean, uint32_t seed);

}  // namespace vcharge
