#pragma once

#include <array>
#include <cstdint>
#include <cstring>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

namespace vcharge {

/// An 8-bit reflectance image with a mipmap pyramid, sampled at the level of detail that fits the pixel
/// footprint. Immutable; reads are thread safe.
class Texture {
 public:
  enum class Border { kClamp, kRepeat };

  /// Takes a CV_8UC1 image; with kRepeat its sides must be powers of two. Throws std::logic_error otherwise.
  Texture(const cv::Mat& image, Border border);

  int width() const { return levels_.front().width; }
  int height() const { return levels_.front().height; }
  int numLevels() const { return static_cast<int>(levels_.size()); }

  /// Value in [0, 1] at (x, y) in texels of the full-size image, whose first texel is centred at (0.5, 0.5).
  /// Interpolates linearly in x, in y and between the two nearest levels; level 0 is the full-size image and
  /// each further level halves it.
  float sample(float x, float y, float level) const {
    if (level <= 0.0F) {
      return bilinear(0, x, y);
    }
    const float last = static_cast<float>(levels_.size() - 1);
    if (level >= last) {
      level = last;
    }
    const int lower = static_cast<int>(level);
    const float weight = level - static_cast<float>(lower);
    const float value = bilinear(lower, x, y);
    if (weight < 0.02F) {
      return value;
    }
    return value + weight * (bilinear(lower + 1, x, y) - value);
  }

  /// Mean of the four samples of one pixel. The coarser level is sampled only twice, between the first two
  /// and between the last two samples, because its texels are wider than the sample spacing.
  float sampleMean(const std::array<float, 4>& x, const std::array<float, 4>& y, float level) const {
    const float last = static_cast<float>(levels_.size() - 1);
    level = level <= 0.0F ? 0.0F : (level >= last ? last : level);
    const int lower = static_cast<int>(level);
    const float weight = level - static_cast<float>(lower);
    const float fine = 0.25F * (bilinear(lower, x[0], y[0]) + bilinear(lower, x[1], y[1]) +
                                bilinear(lower, x[2], y[2]) + bilinear(lower, x[3], y[3]));
    if (weight < 0.02F) {
      return fine;
    }
    const float coarse = 0.5F * (bilinear(lower + 1, 0.5F * (x[0] + x[1]), 0.5F * (y[0] + y[1])) +
                                 bilinear(lower + 1, 0.5F * (x[2] + x[3]), 0.5F * (y[2] + y[3])));
    return fine + weight * (coarse - fine);
  }

 private:
  struct Level {
    size_t offset;
    int width, height;
    float x_scale, y_scale;
  };

  float bilinear(int index, float x, float y) const {
    const Level& level = levels_[static_cast<size_t>(index)];
    x = x * level.x_scale - 0.5F;
    y = y * level.y_scale - 0.5F;
    int x0 = floorToInt(x);
    int y0 = floorToInt(y);
    const float wx = x - static_cast<float>(x0);
    const float wy = y - static_cast<float>(y0);
    int x1 = x0 + 1;
    int y1 = y0 + 1;
    if (border_ == Border::kRepeat) {
      x0 &= level.width - 1;
      x1 &= level.width - 1;
      y0 &= level.height - 1;
      y1 &= level.height - 1;
    } else {
      x0 = clamp(x0, level.width);
      x1 = clamp(x1, level.width);
      y0 = clamp(y0, level.height);
      y1 = clamp(y1, level.height);
    }
    const uint8_t* row0 = texels_.data() + level.offset + static_cast<size_t>(y0) * level.width;
    const uint8_t* row1 = texels_.data() + level.offset + static_cast<size_t>(y1) * level.width;
    const float v0 = static_cast<float>(row0[x0]) + wx * static_cast<float>(row0[x1] - row0[x0]);
    const float v1 = static_cast<float>(row1[x0]) + wx * static_cast<float>(row1[x1] - row1[x0]);
    return (v0 + wy * (v1 - v0)) * (1.0F / 255.0F);
  }
  // Faster than std::floor, which is a library call on baseline x86-64.
  static int floorToInt(float value) {
    const int truncated = static_cast<int>(value);
    return truncated - (value < static_cast<float>(truncated) ? 1 : 0);
  }
  static int clamp(int index, int size) { return index < 0 ? 0 : (index >= size ? size - 1 : index); }

  Border border_;
  std::vector<Level> levels_;
  std::vector<uint8_t> texels_;
};

/// A texture on the ground plane, addressed by world coordinates in metres.
struct GroundTexture {
  Texture texture;
  float min_x_m, min_y_m;  ///< corner of the first texel
  float texels_per_m;

  /// See Texture::sample.
  float sampleAt(float x_m, float y_m, float level) const {
    return texture.sample((x_m - min_x_m) * texels_per_m, (y_m - min_y_m) * texels_per_m, level);
  }

  /// See Texture::sampleMean.
  float sampleMeanAt(const std::array<Eigen::Vector3f, 4>& positions_m, float level) const {
    std::array<float, 4> x;
    std::array<float, 4> y;
    for (size_t i = 0; i < 4; ++i) {
      x[i] = (positions_m[i].x() - min_x_m) * texels_per_m;
      y[i] = (positions_m[i].y() - min_y_m) * texels_per_m;
    }
    return texture.sampleMean(x, y, level);
  }
};

/// Approximates log2 to about 0.01, for levels of detail; `value` must be positive.
inline float fastLog2(float value) {
  uint32_t bits;
  std::memcpy(&bits, &value, sizeof(bits));
  const float exponent = static_cast<float>(static_cast<int>(bits >> 23) - 127);
  bits = (bits & 0x007FFFFFU) | 0x3F800000U;
  float mantissa;
  std::memcpy(&mantissa, &bits, sizeof(mantissa));
  // Quadratic that interpolates log2 at 1, sqrt(2) and 2.
  return exponent + (-0.3431457F * mantissa + 2.0294373F) * mantissa - 1.6862915F;
}

}  // namespace vcharge
