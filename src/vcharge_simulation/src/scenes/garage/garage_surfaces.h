#pragma once

#include <cstdint>
#include <string>

#include <opencv2/core.hpp>

#include "scenes/garage/garage_layout.h"

namespace vcharge {

/// Resolution of the textures of walls and pillars.
inline constexpr double kGarageTexelsPerM = 64.0;

/// Reflectance of the garage floor divided by kGroundLayerAlbedo (CV_8UC1, row 0 at min_y): painted concrete
/// with joints, tyre marks, oil, cracks and markings.
cv::Mat drawGarageFloor(const GarageLayout& layout, double texel_m, uint64_t seed);
/// Draws wear on the garage floor: oil, drops, chewing gum, grit, tyre marks, lime around dried puddles,
/// mortar patches and litter. Returns CV_32FC1, a factor on the reflectance of the clean floor; row 0 is at
/// min_y of the garage.
cv::Mat drawGarageStains(const GarageLayout& layout, double texel_m, uint64_t seed);
/// Reflectance of a concrete wall with a painted band, signs, doors, stains and cast joints.
cv::Mat drawGarageWall(double width_m, double height_m, const GarageWallKind& kind, uint32_t seed);
/// The four faces of a pillar side by side, with the pillar's name, warning stripes and scratches.
cv::Mat drawGaragePillar(const std::string& name, double width_m, double height_m, uint32_t seed);
/// Bare concrete with the imprint of its formwork.
cv::Mat drawFormedConcrete(int width_px, int height_px, double mean, uint32_t seed);

}  // namespace vcharge
