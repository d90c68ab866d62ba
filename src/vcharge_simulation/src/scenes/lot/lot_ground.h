#pragma once

#include <cstdint>

#include <opencv2/core.hpp>

#include "scenes/lot/lot_layout.h"

namespace vcharge {

/// Area of the detailed ground texture; a coarser one surrounds it.
inline constexpr GroundRectangle kLotArea{-40.0, -30.0, 40.0, 30.0};

/// Reflectance of the lot's ground divided by kGroundLayerAlbedo (CV_8UC1, row 0 at min_y): asphalt, cobbles,
/// bricks and grass with cracks, stains, patches, markings and manhole covers. It does not repeat.
cv::Mat drawLotGround(const LotLayout& layout, double texel_m, uint64_t seed);
/// Reflectance of the ground beyond the lot: grass, streets and paths.
cv::Mat drawFarGround(double min_m, double size_m, double texel_m, uint64_t seed);
/// A seamless tile of fine relief with mean 0.5; `size` must be a power of two.
cv::Mat drawGroundDetail(int size, uint64_t seed);
/// Antialiased markings (CV_8UC1, 255 is paint, 128 a manhole): lanes, bays, numbers and arrows.
cv::Mat drawLotMarkings(const LotLayout& layout, double texel_m, uint64_t seed);

}  // namespace vcharge
