#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <opencv2/core.hpp>

namespace vcharge {

/// 256 comparisons of two smoothed pixels each (Calonder, ECCV 2010, with normally distributed pairs),
/// upright since the cameras do not roll. Integer arithmetic makes the pattern the same on any machine, so
/// descriptors can be stored in maps.
class BriefDescriptor {
 public:
  static constexpr int kBytes = 32;
  static constexpr int kBits = 8 * kBytes;
  static constexpr int kRadius_px = 15;  ///< radius of the circle that contains all compared pixels

  /// `step`: distance between rows of the smoothed image in bytes.
  explicit BriefDescriptor(int64_t step);

  /// Writes kBytes at `descriptor` for the patch around `centre`, which must be at least kRadius_px inside
  /// the image. Bit i of byte b is comparison 8 b + i.
  void describe(const uint8_t* centre, uint8_t* descriptor) const;

 private:
  struct PixelPair {
    int64_t first, second;
  };
  std::array<PixelPair, kBits> offsets_;
};

}  // namespace vcharge
