#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <opencv2/core.hpp>

namespace vcharge {

/// 256 comparisons of two smoothed pixels each (Calonder, ECCV 2010, its normally distributed pairs). The
/// pattern is made by integer arithmetic alone, so that descriptors stored in a map fit those of any machine.
/// Turned patterns (Rublee, ICCV 2011) come in steps of 360/32 degrees.
class BriefDescriptor {
 public:
  static constexpr int kBytes = 32;
  static constexpr int kBits = 8 * kBytes;
  static constexpr int kRadius_px = 15;  ///< radius of the circle that contains all compared pixels
  static constexpr int kNumAngles = 32;

  /// `step`: distance between rows of the smoothed image in bytes.
  explicit BriefDescriptor(int64_t step);

  /// Writes kBytes at `descriptor` for the patch about `centre`, which lies kRadius_px or more inside the
  /// image. Bit i of byte b is comparison 8 b + i.
  void describe(const uint8_t* centre, float angle_rad, uint8_t* descriptor) const;

  /// Direction from the centre to the centroid of the intensities in a disk of kRadius_px, in [0, 2 pi).
  static float intensityCentroidAngle(const uint8_t* centre, int64_t step);

 private:
  struct PixelPair {
    int64_t first, second;
  };
  std::array<std::array<PixelPair, kBits>, kNumAngles> offsets_;
};

}  // namespace vcharge
