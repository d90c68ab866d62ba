#pragma once

#include <cstdint>

#include <opencv2/core.hpp>

#include "scenes/lot/lot_layout.h"

namespace vcharge {

/// Area that the ground's own texture covers; around it lies a coarser one.
inline constexpr GroundRectangle kLotArea{-40.0, -30.0, 40.0, 30.0};

/// Reflectance over kGroundLayerAlbedo of the lot's ground (CV_8UC1, row 0 at min_y): asphalt, cobbles,
/// bricks and grass with cracks, stains, patches, markings and manhole covers; different everywhere.
cv::Mat drawLotGround(const LotLayout& layout, double texel_m, uint64_t seed);
/// The ground beyond the lot: grass, streets and paths.
cv::Mat drawFarGround(double min_m, double size_m, double texel_m, uint64_t seed);
/// A seamless tile of fine relief about 0.5 (size a power of two).
cv::Mat drawGroundDetail(int size, uint64_t seed);
/// Antialiased markings (CV_8UC1, 255 is paint): lanes, bays, numbers, arrows, manholes (128).
cv::Mat drawLotMarkings(const LotLayout& layout, double texel_m, uint64_t seed);

}  // namespace vcharge
